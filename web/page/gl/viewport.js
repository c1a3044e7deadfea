// The view through the canvas: its resolution, which is that of the screen, and less while the visitor moves
// on a machine that cannot keep up; its angles and its depth.

import { frustumOf } from "../space/frustum.js";
import { cameraOf } from "./camera.js";

/** The most pixels drawn for one of CSS, also on finer screens. */
const MOST = 2;
/** Shares of the full number of lines. */
const SHARES = [1, 0.7, 0.5];
/** Seconds a frame beyond which the next share is taken, and below which the one before, for the next
 * movement; and frames whose median is judged. */
const SLOW = 0.045, FAST = 0.035, FRAMES = 6;
/** Largest vertical field of view on a narrow screen, radians. */
const TALLEST = 1.4;

/** @typedef {import("./camera.js").Pose} Pose */

export class Viewport {
  #step = 0;
  /** @type {number[]} */
  #times = [];

  /**
   * @param {HTMLCanvasElement} canvas
   * @param {import("../data/site.js").Index} index
   */
  constructor(canvas, { cells, viewpoints }) {
    this.canvas = canvas;
    /** The smaller field of view, radians. */
    this.angle = viewpoints[0]?.fieldOfView ?? Math.PI / 3;
    const low = [0, 1, 2].map((k) => Math.min(...cells.map(({ box }) => box[k])));
    const high = [0, 1, 2].map((k) => Math.max(...cells.map(({ box }) => box[k + 3])));
    /** The far plane, metres: geometry outside of the cells is drawn, too. */
    this.far = 10 + 3 * Math.hypot(...high.map((x, k) => x - low[k]));
  }

  get aspect() {
    return this.canvas.width / this.canvas.height;
  }

  /** Vertical field of view, radians. */
  get tall() {
    const aspect = this.aspect;
    if (aspect >= 1) return this.angle;
    return Math.min(TALLEST, 2 * Math.atan(Math.tan(this.angle / 2) / aspect));
  }

  /** @param {Pose} pose */
  frustum(pose) {
    return frustumOf(pose, this.tall, this.aspect);
  }

  /** @param {Pose} pose */
  camera(pose) {
    return cameraOf(pose, this.tall, this.aspect, this.far);
  }

  /** Lines of the screen at full resolution. */
  get lines() {
    return this.#size(1)[1];
  }

  /** Lines of the screen across a field of view. @param {number} angle radians */
  across(angle) {
    return this.lines * Math.tan(angle / 2) / Math.tan(this.tall / 2);
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
