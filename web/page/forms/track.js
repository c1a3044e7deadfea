// Records where a visitor of a single object is and looks, as a walk for simulators (docs/formats/walk.md).

import { clock } from "../net/fetcher.js";

/** Digits behind the point: 0.01 mm and 0.01 ms. @param {number} x */
const short = (x) => Math.round(x * 1e5) / 1e5;

/**
 * @typedef {object} Look
 * @property {ArrayLike<number>} eye
 * @property {ArrayLike<number>} direction unit vector
 * @property {number} angle vertical field of view, radians
 */

export class Track {
  /** t, eye, direction. @type {number[][]} */
  #samples = [];
  #begun = clock();

  /** @param {HTMLCanvasElement} canvas @param {() => Look} look */
  constructor(canvas, look) {
    this.canvas = canvas;
    this.look = look;
  }

  /** Records a frame. */
  frame() {
    const { eye, direction } = this.look(), at = this.#samples.length ? clock() - this.#begun : 0;
    const sample = [at, ...Array.from(eye), ...Array.from(direction)].map(short);
    if (!this.#samples.length || sample[0] > this.#samples[this.#samples.length - 1][0]) this.#samples.push(sample);
  }

  /** The document of the walk. */
  get document() {
    const { canvas: { width, height } } = this;
    return {
      format: "ptmtools walk", schema: 1, fieldOfView: this.look().angle, aspect: width / height,
      samples: this.#samples,
    };
  }
}
