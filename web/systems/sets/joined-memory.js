// Texture memory of interlaced images: each has the image of its files so far, with mip levels. A further
// file is joined to it in one draw; a texture that shrinks is joined again from its first file on, while the
// old image is shown. Until a step is complete there are the image before, the file and the new image; like
// the simulator, the budget does not count the first two.

import { Joiner } from "../forms/joining.js";

/** @typedef {import("../../page/gl/renderer.js").Textures} Textures */
/** @typedef {import("../forms/joining.js").Picture} Picture */
/** @typedef {import("./sets.js").TextureSet} TextureSet */

/** The most files that are decoded at a time. */
const DECODING = 3;

/** The image of the first files of a set, as the renderer draws from it. */
class Joined {
  #wrap = -1;
  left = 0;

  /** @param {WebGL2RenderingContext} gl @param {TextureSet} set */
  constructor(gl, set) {
    this.gl = gl;
    this.set = set;
    this.channels = set.channels;
    this.steps = 0;
    /** @type {WebGLTexture | null} */
    this.texture = null;
  }

  get bytes() {
    return this.steps ? this.set.memory[this.steps - 1] : 0;
  }

  /** @param {Joiner} joiner @param {Picture} image of the next file */
  add(joiner, image) {
    const next = joiner.upload(image);
    this.texture = joiner.join(this.set.parts[this.steps], this.texture, next, this.channels, true);
    this.steps++;
    this.#wrap = -1;
  }

  /** Binds the texture for drawing. It fades nothing. @param {boolean} clampU @param {boolean} clampV */
  bind(clampU, clampV) {
    const { gl } = this, wrap = +clampU + 2 * +clampV;
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    if (wrap !== this.#wrap) {
      const [s, t] = [clampU, clampV].map((clamp) => (clamp ? gl.CLAMP_TO_EDGE : gl.REPEAT));
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, s);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, t);
      this.#wrap = wrap;
    }
    return false;
  }

  delete() {
    this.gl.deleteTexture(this.texture);
  }
}

/** Work on a texture: `joined` grows; it is the one that is shown, or will take its place. */
class Work {
  /** The next file, once it is decoded. @type {Picture | null} */
  image = null;

  /** @param {Joined} joined */
  constructor(joined) {
    this.joined = joined;
  }
}

export class JoinedMemory {
  /** @type {(Joined | null)[]} */
  #shown;
  /** @type {Map<number, Work>} */
  #work = new Map();
  /** @type {Joiner | null} */
  #joiner = null;
  #want;
  #priority;
  /** Steps lost with the context. */
  #lost;

  /** @param {WebGL2RenderingContext} gl @param {TextureSet[]} sets of the textures */
  constructor(gl, sets) {
    this.gl = gl;
    this.sets = sets;
    this.#shown = sets.map(() => null);
    this.held = new Int32Array(sets.length);
    this.loss = new Float64Array(sets.length);
    this.#want = new Int32Array(sets.length);
    this.#lost = new Int32Array(sets.length);
    this.#priority = new Float64Array(sets.length);
    this.budget = Infinity;
    this.peak = 0;
    /** It has nothing to fade. */
    this.fades = true;
  }

  /** Bytes of the images, those included that are to take the place of others. */
  get bytes() {
    const joined = [...this.#shown, ...[...this.#work.values()].map((work) => work.joined)];
    return [...new Set(joined)].reduce((sum, one) => sum + (one?.bytes ?? 0), 0);
  }

  /** @param {number} texture */
  of(texture) {
    return this.#shown[texture];
  }

  /** Starts the work that leads to these columns. @param {Int32Array} want @param {Float64Array} priority */
  settle(want, priority) {
    this.#want.set(want);
    this.#priority.set(priority);
    this.#lost.fill(0);
    for (let t = 0; t < want.length; t++) if (want[t] === 0) this.#clear(t);
    this.#next();
  }

  hold() {
    this.#want = this.held.map((held, t) => Math.max(held, Math.min(this.#want[t], this.#lost[t])));
  }

  resume() {
    this.#next();
  }

  /** Decodes the next files, as long as decoders are free. */
  #next() {
    const waiting = () => [...this.#work.values()].filter(({ image }) => !image).length;
    const order = [...this.held.keys()].filter((t) => this.#want[t] > 0 && this.held[t] !== this.#want[t]);
    order.sort((a, b) => +(this.held[a] > 0) - +(this.held[b] > 0) || this.#priority[b] - this.#priority[a]);
    for (const t of order) {
      if (waiting() >= DECODING) break;
      if (this.#work.has(t)) continue;
      const shown = this.#shown[t], grows = shown && shown.steps < this.#want[t];
      this.#start(t, grows ? shown : new Joined(this.gl, this.sets[t]));
    }
  }

  /** @param {number} t @param {Joined} joined */
  #start(t, joined) {
    const work = new Work(joined);
    this.#work.set(t, work);
    this.sets[t].image(joined.steps).then((image) => {
      if (this.#work.get(t) === work) work.image = image;
      else if ("close" in image) image.close();
    }, () => this.#drop(t));
  }

  /** Ends the work on a texture. @param {number} t */
  #drop(t) {
    const work = this.#work.get(t);
    this.#work.delete(t);
    if (work?.image && "close" in work.image) work.image.close();
    if (work && work.joined !== this.#shown[t]) work.joined.delete();
  }

  /** @param {number} t */
  #clear(t) {
    this.#drop(t);
    this.#shown[t]?.delete();
    this.#shown[t] = null;
    this.held[t] = 0;
  }

  /** Joins files until none is left or the time is up; true if it joined any. @param {number} _now
   * @param {() => boolean} late */
  pump(_now, late) {
    let done = false;
    for (const [t, { image, joined }] of [...this.#work]) {
      if (!image) continue;
      if (late() && done) break;
      this.#joiner ??= new Joiner(this.gl);
      joined.add(this.#joiner, image);
      done = true;
      this.peak = Math.max(this.peak, this.bytes);
      this.#work.delete(t);
      const shown = this.#shown[t], want = this.#want[t];
      // In place of a finer image only one of the wanted steps is shown.
      if (!shown || joined === shown || joined.steps >= want) {
        if (joined !== shown) shown?.delete();
        this.#shown[t] = joined;
        this.held[t] = joined.steps;
      } else if (shown.steps > want) {
        this.#start(t, joined);
      } else {
        joined.delete();
      }
    }
    if (done) this.#next();
    return done;
  }

  /** The texels of a texture's image, four bytes each, rows from the top, and its size. @param {number} texture */
  texels(texture) {
    const shown = this.#shown[texture];
    if (!shown || !this.#joiner) return null;
    const { width, height } = shown.set.parts[shown.steps - 1].joined;
    return { width, height, texels: this.#joiner.texels(shown.texture, width, height) };
  }

  delete() {
    for (let t = 0; t < this.sets.length; t++) this.#clear(t);
  }

  /** Drops everything with the lost context; `resume` restores it. */
  lose() {
    this.#lost = this.held.map((held, t) => Math.max(held, this.#lost[t]));
    this.#shown.fill(null);
    this.#work.clear();
    this.#joiner = null;
    this.held.fill(0);
  }
}
