// The client of a campus (docs/formats/campus.md, "A client"): which files come next, and in which detail
// each object is shown. It decides as `ptmtools_lab.campus.client` does.

import { CAMPUS_MOVE, CAMPUS_NEAREST, CAMPUS_THREADS } from "../../page/policy/constants.js";

/** @typedef {import("./index.js").CampusIndex} CampusIndex */
/** @typedef {import("./index.js").Preset} Preset */

/**
 * Metres from an eye to where the segment from an object's barycentre to it leaves the box; 0 inside.
 * @param {ArrayLike<number>} eye @param {number[]} box @param {number[]} barycentre
 */
export function distanceTo(eye, box, barycentre) {
  let left = 1, square = 0;
  for (let k = 0; k < 3; k++) {
    const way = eye[k] - barycentre[k], room = (way > 0 ? box[3 + k] : box[k]) - barycentre[k];
    if (way !== 0) left = Math.min(left, Math.max(0, room / way));
    square += way * way;
  }
  return (1 - left) * Math.sqrt(square);
}

export class CampusClient {
  /** Objects by distance, and those in high detail. @type {number[]} */
  order = [];
  /** @type {number[]} */
  near = [];
  sorts = 0;
  /** Files that were requested, and those that are there. @type {Set<string>} */
  asked = new Set();
  /** @type {Set<string>} */
  loaded = new Set();
  /** Files that cannot be had. @type {Set<string>} */
  failed = new Set();
  #begun = false;
  /** Files of each thread that are still to be requested. @type {string[][]} */
  #threads = [];
  /** @type {number[] | null} */
  #sortedAt = null;

  /** @param {CampusIndex} index @param {Preset} preset */
  constructor(index, preset) {
    this.index = index;
    this.preset = preset;
  }

  /** Another preset: objects keep what they have. @param {Preset} preset */
  choose(preset) {
    this.preset = preset;
  }

  /** The visitor is somewhere; whether objects were sorted. @param {number[]} eye */
  look(eye) {
    const before = this.#sortedAt;
    if (before && Math.hypot(...eye.map((x, k) => x - before[k])) < CAMPUS_MOVE) return false;
    this.#sortedAt = [...eye];
    this.sorts++;
    const far = this.index.objects.map(({ box, barycentre }) => distanceTo(eye, box, barycentre));
    this.order = [...far.keys()].sort((a, b) => far[a] - far[b] || a - b);
    this.near = this.order.slice(0, CAMPUS_NEAREST);
    return true;
  }

  /** Whether all low detail is there. */
  get begun() {
    this.#begun ||= this.order.length > 0
      && this.order.every((k) => this.index.low(k).every((file) => this.loaded.has(file)));
    return this.#begun;
  }

  /** Whether an object has the detail of the preset. @param {number} k */
  full(k) {
    return this.index.high(k, this.preset).every((file) => this.loaded.has(file) || this.failed.has(file));
  }

  /** Whether nothing is missing for this place. */
  get complete() {
    return this.begun && this.near.every((k) => this.full(k));
  }

  /** The next file for a free thread, or null: low detail of all objects comes before high detail of any. */
  next() {
    if (this.#threads.length >= CAMPUS_THREADS) return null;
    for (const [objects, high] of /** @type {[number[], boolean][]} */ ([[this.begun ? [] : this.order, false], [this.near, true]])) {
      for (const k of objects) {
        const files = high ? this.index.high(k, this.preset) : this.index.low(k);
        const lacking = files.filter((file) => !this.asked.has(file));
        if (!lacking.length) continue;
        const thread = lacking;
        this.#threads.push(thread);
        return { file: this.#take(thread), thread };
      }
    }
    return null;
  }

  /** The next file of a thread, which never leaves an object that it has begun; null at its end.
   * @param {string[]} thread */
  after(thread) {
    while (thread.length && this.asked.has(thread[0])) thread.shift();
    if (thread.length) return this.#take(thread);
    this.#threads = this.#threads.filter((one) => one !== thread);
    return null;
  }

  /** @param {string[]} thread */
  #take(thread) {
    const file = /** @type {string} */ (thread.shift());
    this.asked.add(file);
    return file;
  }
}
