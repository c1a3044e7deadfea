// The policy of docs/formats/client.md: the greatest worth for its bytes, by the pixels of the view, by
// distance and by the needs of the cell. Texture memory is allocated to the last level that fits;
// missing levels are requested in ranges of a fraction of a second, so that few requests under way
// become useless. After that, it requests the levels that are worth most beyond the budget. Previews
// compete with the exact levels, and these replace them as they arrive.

import { allocate, nextFetch } from "./allocation.js";
import { lookAround, weighGeometry } from "./around.js";
import {
  HELD, HELD_ON, HELD_SECONDS, LONGEST_WAIT, NOTHING, OVERHEAD, RANGE_BYTES, RANGE_SECONDS, RECORD_SHARE,
  SURROUNDINGS,
} from "./constants.js";
import { NO_SOURCE } from "./downloads.js";
import { gainsOf } from "./meshes.js";
import { meetsBox } from "../space/frustum.js";

/** @typedef {import("./client.js").Client} Client */
/** @typedef {import("./client.js").Policy} Policy */
/** @typedef {import("./estimate.js").Belief} Belief */

/**
 * Whether the link would run dry before a request made later could be answered.
 * @param {Belief} estimate
 * @param {Iterable<{left: number, waits?: boolean}>} waiting requests on the way
 */
export function room(estimate, waiting) {
  let left = 0, count = 0;
  for (const request of waiting) {
    left += Math.max(request.left, 0);
    count += +!request.waits;
  }
  const ahead = estimate.latency + RANGE_SECONDS / 2;
  return count < estimate.concurrency && (left === 0 || 8 * left < ahead * estimate.bandwidth);
}

/**
 * Bytes that a request costs besides its own: headers, and those that its connection could have
 * brought while it waits. So a fast link requests more levels at once.
 * @param {Belief} estimate
 */
export function overheadOf({ latency, bandwidth, concurrency }) {
  const waiting = latency > 0 ? latency * bandwidth / 8 / concurrency : 0;
  return OVERHEAD + Math.floor(Math.min(waiting, LONGEST_WAIT));
}

/** @implements {Policy} */
export class Best {
  #client; #geometry; #wanted; #last; #worth;
  /** @type {Float64Array} (T × K) share of the view that wants each column, in texture memory; and
   *   lately */
  #hold; #kept;
  /** @type {Float64Array} ((T + P) × K) gain of each column by each source soon, and beyond the budget */
  #fetch; #ahead;
  #weighed = false;
  #looked = -Infinity;

  /** @param {Client} client */
  constructor(client) {
    const { T, C, K, gains } = client.catalogue;
    this.#client = client;
    this.target = new Int32Array(T);
    this.#hold = new Float64Array(T * K);
    this.#kept = new Float64Array(T * K);
    this.#fetch = new Float64Array(gains.length);
    this.#ahead = new Float64Array(gains.length);
    /** What is computed for a single choice. */
    this.#worth = new Float64Array(gains.length);
    this.#last = new Int32Array(T);
    /** (C) gain of the geometry of each cell. */
    this.#geometry = new Float64Array(C);
    /** (T) the allocation if everything were downloaded. */
    this.#wanted = new Int32Array(T);
  }

  learned() {
    const client = this.#client;
    if (client.cell < 0 && client.known[client.here]) client.cell = client.here;
    this.#weighed = false;
  }

  look() {
    const { cell, downloads } = this.#client;
    if (cell < 0) return;
    this.#weigh();
    const fading = 0.5 ** ((downloads.now - this.#looked) / HELD_SECONDS);
    this.#looked = downloads.now;
    const kept = this.#kept, hold = this.#hold;
    for (let i = 0; i < kept.length; i++) kept[i] = Math.max(kept[i] * fading, hold[i]);
    this.fit();
  }

  fit() {
    const { catalogue, cell, budget, column } = this.#client;
    if (cell >= 0) allocate(this.#showing(), catalogue.memory, this.#last, budget, column);
  }

  /**
   * ((T + P) × K) worth of each column in texture memory by each source; its first rows are the exact
   * levels.
   */
  #holding() {
    const kept = this.#kept;
    const share = this.#hold.map((hold, i) => hold + HELD_ON * kept[i] + HELD_ON ** 2);
    return this.#gained(share, this.#worth);
  }

  /**
   * Worth of each column, by the best source that is present, beside those before it; `#last` becomes
   * the last column of each texture. Where exact levels suffice for the view, no preview that is finer
   * replaces them.
   */
  #showing() {
    const { catalogue: { T, K }, sight, have, downloads } = this.#client;
    const worth = this.#holding(), last = this.#last;
    for (let t = 0; t < T; t++) {
      const at = t * K, reach = downloads.reach(t);
      let seen = reach.exact;
      while (seen + 1 < K && !(sight[at + seen + 1] > 0)) seen++;
      last[t] = sight[at + 1] > 0 && seen + 1 === K ? reach.exact : reach.last;
      let before = 0;
      for (let k = 1; k <= have[t]; k++) before += worth[at + k];
      for (let k = have[t] + 1; k <= last[t]; k++) {
        const row = (T + downloads.source(t, k)) * K;
        let value = 0;
        for (let j = 1; j <= k; j++) value += worth[row + j];
        worth[at + k] = value - before;
        before = value;
      }
    }
    return worth;
  }

  /**
   * Writes the gains of shares by each source.
   * @param {Float64Array} share (T × K)
   * @param {Float64Array} into ((T + P) × K)
   */
  #gained(share, into) {
    const { T, K, gains, previews: { first } } = this.#client.catalogue;
    for (let i = 0; i < share.length; i++) into[i] = share[i] * gains[i];
    for (let t = 0; t < T; t++) {
      for (let p = first[t]; p < first[t + 1]; p++) {
        for (let k = 1, at = (T + p) * K + 1; k < K; k++, at++) into[at] = share[t * K + k] * gains[at];
      }
    }
    return into;
  }

  #weigh() {
    if (this.#weighed || this.#client.cell < 0) return;
    this.#weighed = true;
    const { catalogue, sight, budget } = this.#client, { T, K, memory, levels } = catalogue;
    const around = new Float64Array(T * K), share = new Float64Array(T * K);
    lookAround(this.#client, around);
    for (let i = 0; i < around.length; i++) {
      this.#hold[i] = sight[i] + HELD * SURROUNDINGS * around[i];
      share[i] = sight[i] + SURROUNDINGS * around[i];
    }
    this.#gained(share, this.#fetch);
    this.#gained(around, this.#ahead);
    weighGeometry(this.#client, this.#geometry);
    allocate(this.#fetch, memory, levels, budget, this.target);
  }

  /** @param {(kind: import("./downloads.js").Kind, number: number) => boolean} counts */
  missing(counts) {
    const { catalogue, sight, cell, here, frustum, column, known, hidden, downloads, budget } =
      this.#client;
    const { T, K, memory, levels, low, high } = catalogue;
    let count = 0;
    if (!downloads.has("record", here) && counts("record", here)) count++;
    if (cell < 0 || !frustum) return count;
    this.#weigh();
    for (const c of known[cell]?.visible ?? []) {
      const seen = c === here || hidden[c] > 0 || meetsBox(frustum, low, high, 3 * c);
      if (seen && !downloads.has("geometry", c) && counts("geometry", c)) count++;
    }
    const there = (/** @type {number} */ k) => downloads.has("mesh", k)
      || (downloads.requested("mesh", k) && !counts("mesh", k));
    gainsOf(this.#client, there).forEach((gain, k) => {
      const { low, high } = catalogue.meshes[k];
      if (gain > 0 && counts("mesh", k) && meetsBox(frustum, low, high)) count++;
    });
    allocate(this.#holding(), memory, levels, budget, this.#wanted);
    for (let t = 0; t < T; t++) {
      const { exact } = downloads.reach(t);
      for (let k = Math.max(this.#wanted[t], column[t]); k > exact; k--) {
        if (!(sight[t * K + k] > 0)) continue;
        const none = downloads.source(t, k) === NO_SOURCE;
        const missing = this.#lacks(t, k, none, counts);
        if (missing) count++;
        if (missing || !none) break;
      }
    }
    return count;
  }

  /**
   * Whether a column that is not exact could be: by any source if none is present, else by an exact one.
   * @param {number} t
   * @param {number} k
   * @param {boolean} none
   * @param {(kind: import("./downloads.js").Kind, number: number) => boolean} counts
   */
  #lacks(t, k, none, counts) {
    const { stored, previews: { first, column, loss } } = this.#client.catalogue;
    if (k <= stored[t] && counts("texture", t)) return true;
    for (let p = first[t]; p < first[t + 1]; p++) {
      if (column[p] >= k && (none || loss[p] === 0) && counts("preview", p)) return true;
    }
    return false;
  }

  /** (T) the columns to fetch: the wanted ones, and those that now show a preview. */
  #limits() {
    const { column, downloads } = this.#client;
    return this.target.map((k, t) =>
      column[t] > k && column[t] > downloads.reach(t).exact ? column[t] : k);
  }

  /** @param {Belief} estimate */
  next(estimate) {
    const { catalogue, known, cell, here, downloads } = this.#client;
    const { C, recordBytes, geometryBytes, levels } = catalogue;
    if (!room(estimate, downloads.waiting)) return null;
    if (downloads.free("record", here)) return downloads.ask("record", here, Infinity);
    if (cell < 0) {
      return downloads.free("geometry", here) ? downloads.ask("geometry", here, Infinity) : null;
    }
    this.#weigh();
    const overhead = overheadOf(estimate);
    /** @param {Float64Array} worth @param {Int32Array} last */
    const next = (worth, last) => nextFetch(
      worth, catalogue, downloads.asked, last, overhead, downloads.free,
      (preview) => downloads.requested("preview", preview));
    let step = next(this.#fetch, this.#limits());

    let nearest = -1, geometry = 0;
    for (let c = 0; c < C; c++) {
      const density = this.#geometry[c] / Math.max(geometryBytes[c], 1);
      if (density > geometry && downloads.free("geometry", c)) [nearest, geometry] = [c, density];
    }
    let least = -1;
    for (const c of known[cell]?.adjacent ?? []) {
      const fewer = least < 0 || recordBytes[c] < recordBytes[least];
      if (fewer && downloads.free("record", c)) least = c;
    }
    const record = least < 0 ? 0 : NOTHING * RECORD_SHARE / recordBytes[least];
    let mesh = -1, finer = 0;
    gainsOf(this.#client, (k) => downloads.requested("mesh", k)).forEach((gain, k) => {
      const density = gain / (catalogue.meshes[k].bytes + overhead);
      if (density > finer && downloads.free("mesh", k)) [mesh, finer] = [k, density];
    });
    if (finer > Math.max(step.density, geometry, record)) return downloads.ask("mesh", mesh, finer);
    if (record > Math.max(step.density, geometry)) return downloads.ask("record", least, record);
    if (geometry > step.density) return downloads.ask("geometry", nearest, geometry);
    if (step.texture < 0) step = next(this.#ahead, levels);
    if (step.preview >= 0) return downloads.ask("preview", step.preview, step.density);
    return step.texture < 0 ? null : this.#range(step, estimate);
  }

  /** @param {import("./allocation.js").Step} step @param {Belief} estimate */
  #range({ texture, column, density }, estimate) {
    const { catalogue, downloads } = this.#client;
    const most = Math.max(RANGE_BYTES, RANGE_SECONDS * estimate.bandwidth / 8);
    const begin = downloads.bytes[texture], whole = catalogue.ends[texture * catalogue.K + column];
    const end = whole - begin > most ? begin + Math.floor(most) : whole;
    return downloads.ask("texture", texture, density, end);
  }
}
