// A client without levels of detail, for comparison, as `ptm simulate --policy whole` simulates it: it
// fetches each visible texture whole, in the order of their first sight, and holds textures whole or
// not at all. When texture memory is full, the least recently seen one leaves. `WholeMemory` draws so.

import { lacking, modelled } from "./files.js";
import { Lru } from "./lru.js";
import { meetsBox } from "../space/frustum.js";

/** @typedef {import("./client.js").Client} Client */
/** @typedef {import("./client.js").Policy} Policy */
/** @typedef {import("./downloads.js").Kind} Kind */
/** @typedef {import("./estimate.js").Belief} Belief */

/** @implements {Policy} */
export class Whole {
  #client;
  #lru = new Lru();
  /** @type {Set<number>} textures by their first sight, and those in view */
  #order = new Set();
  /** @type {Set<number>} */
  #seen = new Set();
  /** Requests so far: the index was the first. */
  #requests = 1;

  /** @param {Client} client */
  constructor(client) {
    this.#client = client;
    this.target = client.column;
  }

  learned() {}

  look() {
    const { catalogue: { K, levels, memory }, column, budget } = this.#client;
    this.#see();
    for (const t of this.#seen) this.#order.add(t);
    for (const t of this.#lru.numbers) if (!this.#whole(t)) this.#lru.drop(t);
    this.#lru.shrink(budget);
    for (const t of this.#seen) {
      if (this.#whole(t)) this.#lru.use(t, memory[t * K + levels[t]], budget);
    }
    column.fill(0);
    for (const t of this.#lru.numbers) column[t] = levels[t];
  }

  /** The textures of shapes in the frustum, of visible cells with geometry. */
  #see() {
    const { cell, frustum, known, shapes, downloads } = this.#client;
    this.#seen.clear();
    const visible = [...(known[cell]?.visible ?? [])].sort((a, b) => a - b);
    for (const c of visible) {
      const some = shapes[c];
      if (!frustum || !some || !downloads.has("geometry", c)) continue;
      const { textures, boxes } = some;
      textures.forEach((t, s) => {
        if (meetsBox(frustum, boxes, boxes, 6 * s, 6 * s + 3)) this.#seen.add(t);
      });
    }
  }

  /** Whether all levels of a texture are here. @param {number} t */
  #whole(t) {
    const { catalogue: { levels }, downloads } = this.#client;
    return downloads.reach(t).last === levels[t] && !this.#lacks(t);
  }

  /** Whether the file of a texture is missing. @param {number} t */
  #lacks(t) {
    const { catalogue: { stored }, have, downloads } = this.#client, [kind, number] = this.#fileOf(t);
    return kind === "texture" ? have[t] < stored[t] : !downloads.has(kind, number);
  }

  /**
   * The file that has all levels: the finest preview, if the `.ptm` lacks the finest.
   * @param {number} t
   * @returns {[Kind, number]}
   */
  #fileOf(t) {
    const { levels, stored, previews: { first } } = this.#client.catalogue;
    return stored[t] < levels[t] ? ["preview", first[t + 1] - 1] : ["texture", t];
  }

  /** @param {(kind: Kind, number: number) => boolean} counts */
  missing(counts) {
    const files = [...this.#seen].filter((t) => this.#lacks(t) && counts(...this.#fileOf(t)));
    return lacking(this.#client, counts) + files.length;
  }

  /** @param {Belief} estimate */
  next({ concurrency }) {
    const { catalogue: { K, ends }, cell, here, known, downloads } = this.#client;
    /** @type {[Kind, number][]} */
    const files = [["record", here]];
    for (const c of known[cell]?.visible ?? []) files.push(["geometry", c]);
    for (const k of modelled(this.#client)) files.push(["mesh", k]);
    if (downloads.waiting.size < concurrency) {
      for (const t of this.#order) if (this.#lacks(t)) files.push(this.#fileOf(t));
    }
    for (const [kind, number] of files) {
      if (!downloads.free(kind, number)) continue;
      const end = kind === "texture" ? ends[number * K + K - 1] : undefined;
      return downloads.ask(kind, number, -this.#requests++, end);
    }
    return null;
  }
}
