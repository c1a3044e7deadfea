// Requested and downloaded bytes. Records, geometry, meshes and previews are requested whole; of a texture's
// `.ptm` one range at a time, each where the last one ended: caches of browsers request ranges again
// while they still receive the file.

import { OVERHEAD } from "./constants.js";

/** @typedef {import("./catalogue.js").Catalogue} Catalogue */
/** @typedef {"record" | "geometry" | "texture" | "preview" | "mesh"} Kind */

/**
 * Bytes `begin` to `end` of a file.
 * @typedef {object} Request
 * @property {Kind} kind
 * @property {number} number of the cell, texture, preview or file of a mesh
 * @property {number} begin
 * @property {number} end an estimate for whole files whose size is not in the index
 * @property {number} priority the greater, the sooner; it may grow
 * @property {number} left bytes still to come, headers included: for the receiver
 *   to keep up to date
 * @property {boolean} [waits] whether it pauses before another try
 */

const ABSENT = 0, ASKED = 1, THERE = 2;
/** In place of the number of a preview: the exact levels, and no source. */
export const EXACT = -1, NO_SOURCE = -2;

export class Downloads {
  #stock;
  /** @type {Record<Kind, Uint8Array>} */
  #state;
  /** @type {Record<Kind, Float64Array>} time before which it is not requested, s */
  #rests;

  /** @param {Catalogue} stock */
  constructor(stock) {
    const { T, C } = stock, P = stock.previews.column.length;
    this.#stock = stock;
    const sizes = { record: C, geometry: C, texture: T, preview: P, mesh: stock.meshes.length };
    /** @template A @param {new (count: number) => A} Kinds @returns {Record<Kind, A>} */
    const each = (Kinds) => /** @type {any} */ (Object.fromEntries(
      Object.entries(sizes).map(([kind, count]) => [kind, new Kinds(count)])));
    this.#state = each(Uint8Array);
    this.#rests = each(Float64Array);
    /** (T) bytes of each texture's `.ptm`, from its beginning. */
    this.bytes = new Float64Array(T);
    /** (T) the same with those that are on the way. */
    this.asked = new Float64Array(T);
    /** (T) complete columns of the `.ptm`. */
    this.have = new Int32Array(T);
    /** @type {Set<Request>} on the way */
    this.waiting = new Set();
    /** Seconds, on the clock of the caller. */
    this.now = 0;
  }

  /** Whether it may be requested. @param {Kind} kind @param {number} number */
  free = (kind, number) =>
    this.#state[kind][number] === ABSENT && this.#rests[kind][number] <= this.now;

  /** Whether a request for it has failed, and it is not to be requested now. @param {Kind} kind @param {number} number */
  rests(kind, number) {
    return this.#rests[kind][number] > this.now;
  }

  /** Whether it is unavailable; such a file does not count as missing. @param {Kind} kind @param {number} number */
  gone(kind, number) {
    return this.#rests[kind][number] === Infinity;
  }

  /** Whether a record, geometry, mesh or preview is complete. @param {Kind} kind @param {number} number */
  has(kind, number) {
    return this.#state[kind][number] === THERE;
  }

  /** Whether it is on its way or complete. @param {Kind} kind @param {number} number */
  requested = (kind, number) => this.#state[kind][number] !== ABSENT;

  /**
   * The best source present of a texture's column: `EXACT`, a preview, or `NO_SOURCE`.
   * @param {number} texture
   * @param {number} column
   */
  source(texture, column) {
    if (column <= this.have[texture]) return EXACT;
    const { first, column: finest, loss } = this.#stock.previews;
    let best = NO_SOURCE;
    for (let p = first[texture]; p < first[texture + 1]; p++) {
      if (finest[p] < column || !this.has("preview", p)) continue;
      if (best < 0 || loss[p] <= loss[best]) best = p;
    }
    return best;
  }

  /** The loss of that source: 0 if it is exact, Infinity without. @param {number} texture @param {number} column */
  loss(texture, column) {
    const source = this.source(texture, column);
    return source === EXACT ? 0 : source < 0 ? Infinity : this.#stock.previews.loss[source];
  }

  /** The finest column that is present, and the finest exact one. @param {number} texture */
  reach(texture) {
    const { first, column, loss } = this.#stock.previews;
    let last = this.have[texture], exact = last;
    for (let p = first[texture]; p < first[texture + 1]; p++) {
      if (!this.has("preview", p)) continue;
      last = Math.max(last, column[p]);
      if (loss[p] === 0) exact = Math.max(exact, column[p]);
    }
    return { last, exact };
  }

  /** @param {Kind} kind @param {number} number */
  came(kind, number) {
    this.#state[kind][number] = THERE;
  }

  /** @param {Kind} kind @param {number} number */
  lost(kind, number) {
    this.#state[kind][number] = ABSENT;
  }

  /**
   * @param {Kind} kind
   * @param {number} number
   * @param {number} priority
   * @param {number} [end] of a texture; a file of another kind has one
   * @returns {Request}
   */
  ask(kind, number, priority, end = 0) {
    const { recordBytes, geometryBytes, previews, meshes } = this.#stock;
    const whole = { record: recordBytes, geometry: geometryBytes, preview: previews.bytes };
    if (kind !== "texture") end = kind === "mesh" ? meshes[number].bytes : whole[kind][number];
    const begin = kind === "texture" ? this.bytes[number] : 0;
    const request = { kind, number, begin, end, priority, left: OVERHEAD + end - begin };
    this.#state[kind][number] = ASKED;
    if (kind === "texture") this.asked[number] = Math.max(begin, end);
    this.waiting.add(request);
    return request;
  }

  /**
   * A request is over; of a texture the bytes up to `end` have arrived.
   * @param {Request} request
   * @param {number} end
   */
  over(request, end) {
    const { kind, number } = request, { K, ends, stored } = this.#stock;
    this.waiting.delete(request);
    if (kind === "preview" || kind === "mesh") this.came(kind, number);
    if (kind !== "texture") return;
    this.lost(kind, number);
    this.bytes[number] = this.asked[number] = Math.max(this.bytes[number], end);
    while (this.have[number] < stored[number]
        && ends[number * K + this.have[number] + 1] <= this.bytes[number]) this.have[number]++;
  }

  /**
   * Keeps only the first bytes of a texture; no more are requested before `until`.
   * @param {number} texture
   * @param {number} bytes
   * @param {number} until
   */
  cut(texture, bytes, until) {
    const { K, ends } = this.#stock;
    this.bytes[texture] = Math.min(this.bytes[texture], bytes);
    while (this.have[texture] > 0 && ends[texture * K + this.have[texture]] > bytes) {
      this.have[texture]--;
    }
    if (this.#state.texture[texture] !== ASKED) this.asked[texture] = this.bytes[texture];
    this.#rests.texture[texture] = until;
  }

  /**
   * Forgets a preview that is damaged; it is not requested before `until`.
   * @param {number} preview
   * @param {number} until
   */
  drop(preview, until) {
    this.lost("preview", preview);
    this.#rests.preview[preview] = until;
  }

  /**
   * A request failed; it is not made again before `until`.
   * @param {Request} request
   * @param {number} until
   */
  failed(request, until) {
    const { kind, number } = request;
    this.waiting.delete(request);
    if (this.#state[kind][number] === ASKED) this.lost(kind, number);
    if (kind === "texture") this.asked[number] = this.bytes[number];
    this.#rests[kind][number] = Math.max(this.#rests[kind][number], until);
  }
}
