// Measures how long the graphics card takes for a picture.

/** The longest time that counts, s: a hidden page notices nothing. */
const LONGEST = 0.5;
/** Times as long as the last one took, on a machine that draws slowly: it also has to decode. */
const PAUSE = 2;

export class Fence {
  /** Seconds from a mark to the frame in which it was reached, of the last such mark. */
  took = 0;
  /** @type {WebGLSync | null} */
  #sync = null;
  #marked = 0;

  /** @param {WebGL2RenderingContext} gl */
  constructor(gl) {
    this.gl = gl;
  }

  /** Whether what was drawn before the mark is not complete. */
  get busy() {
    return this.#sync !== null;
  }

  /** Seconds between pictures of a resting visitor. @param {number} least */
  pause(least) {
    return Math.max(least, PAUSE * this.took);
  }

  /** Marks the end of a picture. @param {number} now s */
  mark(now) {
    const { gl } = this;
    gl.deleteSync(this.#sync);
    this.#sync = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    this.#marked = now;
    gl.flush();
  }

  /** Whether the mark is reached just now. @param {number} now s */
  reached(now) {
    const { gl } = this, sync = this.#sync;
    if (!sync || gl.getSyncParameter(sync, gl.SYNC_STATUS) !== gl.SIGNALED) return false;
    gl.deleteSync(sync);
    this.#sync = null;
    this.took = Math.min(now - this.#marked, LONGEST);
    return true;
  }
}
