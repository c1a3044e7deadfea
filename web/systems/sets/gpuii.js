// The client of interlaced images of Englert et al. (2014, section 3.3), as `ptm simulate --policy gpuii`
// simulates it. The next file is the most important one: its image is visible, as far as boxes tell; the
// screen needs it, where texels so far are wider or higher than pixels; it is in the nearest ring around the
// eye; and it is of the lowest step there. Normal maps of materials come after all colours. Texture memory is
// filled with steps in the same order, and the rest of it with the others that are here, the last seen first.

import { RING } from "../../page/policy/constants.js";
import { lacking, modelled } from "../../page/policy/files.js";
import { distance, meetsBox } from "../../page/space/frustum.js";

/** @typedef {import("../../page/policy/client.js").Client} Client */
/** @typedef {import("../../page/policy/client.js").Policy} Policy */
/** @typedef {import("../../page/policy/downloads.js").Kind} Kind */
/** @typedef {import("../../page/policy/estimate.js").Belief} Belief */
/** @typedef {import("./sets.js").TextureSet} TextureSet */
/** @typedef {import("./pieces.js").Piece} Piece */

/** The nearest distance that counts, metres. */
const NEAR = 0.05;

/** @implements {Policy} */
export class Gpuii {
  #client; #sets; #pieces; #pixel; #later;
  /** (T) metres to each texture in view, and the columns that the screen needs. */
  #distance; #wanted;
  /** (T) the look at which each was seen last, and their number. */
  #seen;
  #looks = 0;
  /** Texture and column of each visible and needed step, the most important first. @type {[number, number][]} */
  #steps = [];
  /** Requests so far: the index was the first. */
  #requests = 1;

  /**
   * @param {Client} client
   * @param {TextureSet[]} sets of the textures
   * @param {Map<number, Piece[]>} pieces of each cell
   * @param {() => number} pixel size of a pixel at a distance of 1
   * @param {boolean[]} later whether each texture comes after all others
   */
  constructor(client, sets, pieces, pixel, later) {
    const { T } = client.catalogue;
    this.#client = client;
    this.#sets = sets;
    this.#pieces = pieces;
    this.#pixel = pixel;
    this.#later = later;
    this.#distance = new Float64Array(T);
    this.#wanted = new Int32Array(T);
    this.#seen = new Int32Array(T).fill(-1);
    this.target = new Int32Array(T);
  }

  learned() {}

  look() {
    const { column, have } = this.#client;
    this.#see();
    this.#order();
    this.#fill(this.#wanted, this.target);
    this.#keep(this.#fill(this.#wanted.map((k, t) => Math.min(k, have[t])), column));
  }

  /** Updates the visible textures, their distances, and the columns that the screen needs. */
  #see() {
    const { catalogue: { T, levels }, downloads, frustum } = this.#client;
    const pixel = this.#pixel(), pixels = new Float64Array(2 * T);
    this.#distance.fill(Infinity);
    this.#looks++;
    for (const [cell, pieces] of this.#pieces) {
      if (!frustum || !downloads.has("geometry", cell)) continue;
      for (const { texture: t, low, high, side } of pieces) {
        if (!meetsBox(frustum, low, high)) continue;
        const far = Math.max(distance(frustum.eye, low, high), NEAR);
        this.#distance[t] = Math.min(this.#distance[t], far);
        for (const i of [0, 1]) pixels[2 * t + i] = Math.max(pixels[2 * t + i], side[i] / (far * pixel));
      }
    }
    for (let t = 0; t < T; t++) {
      this.#wanted[t] = 0;
      if (this.#distance[t] === Infinity) continue;
      const coarse = this.#sets[t].parts.filter(({ joined: { width, height } }) =>
        width < pixels[2 * t] || height < pixels[2 * t + 1]).length;
      this.#wanted[t] = Math.min(coarse + 1, levels[t]);
      this.#seen[t] = this.#looks;
    }
  }

  /** Orders the needed steps: colours first, by ring, step, distance. */
  #order() {
    const far = this.#distance, later = this.#later, ring = (/** @type {number} */ t) => Math.floor(far[t] / RING);
    this.#steps = [];
    this.#wanted.forEach((last, t) => {
      for (let step = 1; step <= last; step++) this.#steps.push([t, step]);
    });
    this.#steps.sort(([a, one], [b, other]) =>
      +later[a] - +later[b] || ring(a) - ring(b) || one - other || far[a] - far[b] || a - b);
  }

  /**
   * Writes the columns that fit, by the order of steps, and returns the bytes that are left.
   * @param {Int32Array} most
   * @param {Int32Array} column
   */
  #fill(most, column) {
    const { budget, catalogue: { K, memory } } = this.#client;
    let left = budget;
    column.fill(0);
    for (const [t, step] of this.#steps) {
      const more = memory[t * K + step] - memory[t * K + step - 1];
      if (step > most[t] || column[t] !== step - 1 || more > left) continue;
      column[t] = step;
      left -= more;
    }
    return left;
  }

  /** Adds other columns that are here, as far as bytes are left. @param {number} left */
  #keep(left) {
    const { catalogue: { K, memory }, column, have } = this.#client, seen = this.#seen;
    const order = [...seen.keys()].filter((t) => seen[t] >= 0);
    order.sort((a, b) => seen[b] - seen[a] || this.#distance[a] - this.#distance[b] || a - b);
    for (const t of order) {
      const held = memory[t * K + column[t]];
      let k = column[t];
      while (k < have[t] && memory[t * K + k + 1] <= held + left) k++;
      column[t] = k;
      left -= memory[t * K + k] - held;
    }
  }

  /** @param {(kind: Kind, number: number) => boolean} counts */
  missing(counts) {
    const { have } = this.#client;
    const lacks = this.target.reduce((sum, k, t) => sum + +(have[t] < k && counts("texture", t)), 0);
    return lacking(this.#client, counts) + lacks;
  }

  /** @param {Belief} estimate */
  next({ concurrency }) {
    const { catalogue: { K, ends }, cell, here, known, downloads } = this.#client;
    /** @type {[Kind, number][]} */
    const files = [["record", here]];
    for (const c of known[cell]?.visible ?? []) files.push(["geometry", c]);
    for (const k of modelled(this.#client)) files.push(["mesh", k]);
    for (const [kind, number] of files) {
      if (downloads.free(kind, number)) return downloads.ask(kind, number, -this.#requests++);
    }
    if (downloads.waiting.size >= concurrency) return null;
    for (const [t, step] of this.#steps) {
      const end = ends[t * K + step];
      if (step > this.target[t] || downloads.asked[t] >= end || !downloads.free("texture", t)) continue;
      return downloads.ask("texture", t, -this.#requests++, end);
    }
    return null;
  }
}
