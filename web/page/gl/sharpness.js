// The resolution of the canvas: that of the screen, and less while the visitor moves on a machine that
// cannot keep up.

/** The most pixels drawn for one of CSS, also on finer screens. */
const MOST = 2;
/** Shares of the full number of lines. */
const SHARES = [1, 0.7, 0.5];
/** Seconds a frame beyond which the next share is taken, and below which the one before, for the next
 * movement; and frames whose median is judged. */
const SLOW = 0.045, FAST = 0.035, FRAMES = 6;

export class Sharpness {
  #step = 0;
  /** @type {number[]} */
  #times = [];

  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
  }

  /** Lines of the screen at full resolution. */
  get lines() {
    return this.#size(1)[1];
  }

  /** Whether the canvas is as fine as the screen. */
  get full() {
    const [width, height] = this.#size(1);
    return this.canvas.width === width && this.canvas.height === height;
  }

  /**
   * Sizes the canvas; true if that changed it.
   * @param {number} seconds since the frame before
   * @param {boolean} moving
   */
  settle(seconds, moving) {
    const { canvas } = this;
    if (moving) this.#times = [...this.#times, seconds].slice(-FRAMES);
    if (this.#times.length === FRAMES) {
      const median = [...this.#times].sort((a, b) => a - b)[FRAMES / 2];
      if (moving && median > SLOW && this.#step < SHARES.length - 1) {
        this.#step++;
        this.#times = [];
      } else if (!moving && median < FAST && this.#step > 0) {
        this.#step--;
      }
    }
    if (!moving) this.#times = [];
    const [width, height] = this.#size(moving ? SHARES[this.#step] : 1);
    if (canvas.width === width && canvas.height === height) return false;
    Object.assign(canvas, { width, height });
    return true;
  }

  /** @param {number} share */
  #size(share) {
    const { clientWidth, clientHeight } = this.canvas, ratio = Math.min(devicePixelRatio, MOST);
    return [clientWidth, clientHeight].map((side) => Math.max(1, Math.round(side * ratio * share)));
  }
}
