// The levels of each texture on the GPU: never more bytes than the budget, those of a texture that is
// being replaced counted twice; uploads in stripes, as long as a frame has time.
//
// Levels that come from a better source, as exact ones in place of a preview, go into the storage that
// is there: it has their size, takes no more memory, and the picture neither fades nor flickers.
//
// Levels are decoded again for each replacement, a third more work than the finest alone. (Tried:
// copying the common levels on the GPU. That needs an open decoder for each texture, with four bytes
// for each of its texels, and a second way of shrinking.)

import { Storage } from "./storage.js";

/** @typedef {import("../../ptm/src/level-decoder.js").Image} Image */

/**
 * @typedef {object} Row
 * @property {{width: number, height: number}[]} sizes of its levels, coarsest first
 * @property {number} channels of a texel on the GPU
 * @property {number[]} offsets of its levels
 *
 * The first levels of a texture.
 * @typedef {object} Decoded
 * @property {Image[]} images
 * @property {number} loss of their source: 0 if they are exact
 *
 * @typedef {(texture: number, levels: number) => Promise<Decoded>} Decode
 */

/** The most textures that are decoded at a time, and that are under way. */
const DECODING = 3, UNDER_WAY = 6;

/** A replacement of a texture's storage, or of the texels in it. */
class Replacement {
  /** @type {Image[] | null} */
  images = null;
  loss = 0;
  /** @type {Storage | null} */
  storage = null;
  /** The level that is uploaded, and the next row of it. */
  level = 0;
  row = 0;

  /**
   * @param {number} texture
   * @param {number} to columns
   */
  constructor(texture, to) {
    this.texture = texture;
    this.to = to;
    /** Whether the storage is the present one. */
    this.inside = false;
  }
}

export class TextureMemory {
  /** @type {(Storage | null)[]} */
  #storages;
  /** @type {Map<number, Replacement>} */
  #underWay = new Map();
  /** @type {Int32Array} */
  #want = new Int32Array(0);
  /** @type {Float64Array} */
  #priority = new Float64Array(0);
  /** The loss of the best source of the wanted columns. @type {Float64Array} */
  #loss;
  #lost;

  /**
   * @param {WebGL2RenderingContext} gl
   * @param {Row[]} rows
   * @param {Decode} decode
   */
  constructor(gl, rows, decode) {
    this.gl = gl;
    this.rows = rows;
    this.decode = decode;
    this.#storages = rows.map(() => null);
    /** Columns on the GPU: the number of levels of each texture. */
    this.held = new Int32Array(rows.length);
    /** The loss of their source, see `Decoded`. */
    this.loss = new Float64Array(rows.length);
    this.#loss = new Float64Array(rows.length);
    /** Columns lost with the context and not chosen again. */
    this.#lost = new Int32Array(rows.length);
    this.budget = Infinity;
    this.bytes = 0;
    /** The most bytes ever held. */
    this.peak = 0;
    this.fades = true;
  }

  /** @param {number} texture */
  of(texture) {
    return this.#storages[texture];
  }

  /**
   * Starts the replacements that lead to these columns, the greatest priority first; shrinking ones
   * before growing ones. Textures that are not wanted at all are freed at once.
   * @param {Int32Array} want columns
   * @param {Float64Array} priority
   * @param {Float64Array} loss of the best source of each
   */
  settle(want, priority, loss) {
    this.#want = want;
    this.#loss = loss;
    this.#lost.fill(0);
    this.#priority = priority;
    for (let t = 0; t < want.length; t++) if (want[t] === 0 && this.held[t]) this.#clear(t);
    // There may be no room to shrink in.
    const shrinking = [...want.keys()].filter((t) => this.held[t] > want[t]);
    shrinking.sort((a, b) => priority[a] - priority[b]);
    const moving = [...this.#underWay.values()].some(({ storage, inside }) => storage && !inside);
    const least = Math.min(...shrinking.map((t) => this.#size(t, want[t])));
    for (const t of shrinking) {
      if (this.bytes <= this.budget && (moving || this.bytes + least <= this.budget)) break;
      this.#clear(t);
    }
    this.#next();
  }

  /** Keeps the present levels, or those before the context was lost, and adds no others. */
  hold() {
    this.#want = this.held.map((held, t) => Math.max(held, Math.min(this.#want[t] ?? 0, this.#lost[t])));
    this.#loss = this.loss.slice();
  }

  /** Restores the levels that were wanted before the context was lost. */
  resume() {
    this.#next();
  }

  /**
   * The texture of the greatest worth among the permitted ones.
   * @param {(texture: number) => boolean} may
   * @param {(texture: number) => number} worth
   */
  #best(may, worth) {
    let best = -1;
    for (let t = 0; t < this.rows.length; t++) {
      if (may(t) && (best < 0 || worth(t) > worth(best))) best = t;
    }
    return best;
  }

  /** Whether the present columns are the wanted ones, and a better source has them. @param {number} t */
  #improves(t) {
    return this.held[t] > 0 && this.held[t] === this.#want[t] && this.#loss[t] < this.loss[t];
  }

  /**
   * Shrinking makes room, anything is better than a colour alone, more levels are better than better ones.
   * @param {number} t
   */
  #urgency(t) {
    const held = this.held[t], want = this.#want[t];
    return want < held ? 2 : held === 0 ? 1 : want > held ? 0 : -1;
  }

  /** Decodes the most urgent textures, as long as decoders are free. */
  #next() {
    const { held } = this, want = this.#want, priority = this.#priority;
    for (;;) {
      const under = [...this.#underWay.values()];
      if (under.filter(({ images }) => !images).length >= DECODING) return;
      // Shrinking makes room for the others.
      const all = under.length < UNDER_WAY;
      const next = this.#best(
        (t) => want[t] > 0 && !this.#underWay.has(t)
          && (want[t] < held[t] || (all && (want[t] > held[t] || this.#improves(t)))),
        (t) => priority[t] + this.#urgency(t),
      );
      if (next < 0) return;
      const replacement = new Replacement(next, want[next]);
      this.#underWay.set(next, replacement);
      this.decode(next, want[next]).then(
        ({ images, loss }) => {
          Object.assign(replacement, { images, loss });
          this.#next();
        },
        () => this.#drop(replacement),
      );
    }
  }

  /** @param {Replacement} replacement */
  #drop(replacement) {
    if (this.#underWay.get(replacement.texture) !== replacement) return;
    if (replacement.storage && !replacement.inside) this.#remove(replacement.storage);
    this.#underWay.delete(replacement.texture);
  }

  /** @param {number} texture */
  #clear(texture) {
    const storage = this.#storages[texture];
    if (storage) this.#remove(storage);
    this.#storages[texture] = null;
    this.held[texture] = 0;
  }

  /**
   * Uploads stripes until none is left or the time is up; true if it uploaded any.
   * @param {number} now s
   * @param {() => boolean} late
   */
  pump(now, late) {
    let done = false;
    const urgent = [...this.#underWay.values()];
    urgent.sort((a, b) => this.#urgency(b.texture) - this.#urgency(a.texture));
    for (const replacement of urgent) {
      while (!late() && this.#step(replacement, now)) done = true;
      if (late()) break;
    }
    if (done) this.#next();
    return done;
  }

  /**
   * Uploads one stripe of a texture; false if none is left or memory is full.
   * @param {Replacement} replacement
   * @param {number} now
   */
  #step(replacement, now) {
    const { texture, to, images, loss } = replacement, held = this.held[texture];
    const { offsets } = this.rows[texture];
    if (!images || this.#underWay.get(texture) !== replacement) return false;
    const want = this.#want[texture], better = to === held && loss < this.loss[texture];
    // No longer wanted; more than wanted; or less than present and wanted.
    if (want === 0 || to > want || (to <= held && want >= held && !better)) {
      this.#drop(replacement);
      return false;
    }
    if (!replacement.storage) {
      replacement.inside = better;
      replacement.storage = better ? this.#storages[texture] : this.#make(texture, to);
    }
    const { storage } = replacement;
    if (!storage || (replacement.inside && storage !== this.#storages[texture])) {
      if (storage) this.#drop(replacement);
      return false;
    }
    const { level, row } = replacement, { data, height } = images[level];
    replacement.row = storage.upload(level, data, row, offsets[level]);
    if (replacement.row >= height) {
      replacement.row = 0;
      replacement.level++;
    }
    if (replacement.level < to) return true;
    this.#underWay.delete(texture);
    this.loss[texture] = loss;
    if (replacement.inside) return true;
    this.#clear(texture);
    this.#storages[texture] = storage;
    this.held[texture] = to;
    if (this.fades && held > 0 && to > held) storage.fadeIn(to - held, now);
    return true;
  }

  /**
   * Storage for a number of levels, or null if memory is full. Growing leaves room for textures that are to
   * shrink; otherwise they never could.
   * @param {number} texture
   * @param {number} levels
   */
  #make(texture, levels) {
    const { sizes, channels } = this.rows[texture], bytes = this.#size(texture, levels);
    const left = levels < this.held[texture] ? 0 : this.#shrinking();
    if (this.bytes + bytes + left > this.budget) return null;
    this.bytes += bytes;
    this.peak = Math.max(this.peak, this.bytes);
    return new Storage(this.gl, sizes.slice(0, levels), channels);
  }

  /** Bytes of a texture's first levels. @param {number} texture @param {number} levels */
  #size(texture, levels) {
    const { sizes, channels } = this.rows[texture];
    return sizes.slice(0, levels).reduce((sum, size) => sum + size.width * size.height * channels, 0);
  }

  /** The most bytes that a texture takes while it shrinks. */
  #shrinking() {
    return this.#want.reduce(
      (most, levels, t) => (levels < this.held[t] ? Math.max(most, this.#size(t, levels)) : most),
      0,
    );
  }

  /** @param {Storage} storage */
  #remove(storage) {
    this.bytes -= storage.bytes;
    storage.delete();
  }

  /** Frees everything, replacements under way included. */
  delete() {
    this.#want = new Int32Array(this.rows.length);
    for (const replacement of [...this.#underWay.values()]) this.#drop(replacement);
    for (let t = 0; t < this.rows.length; t++) this.#clear(t);
  }

  /** Drops everything with the lost context; `resume` restores it. */
  lose() {
    this.#lost = this.held.map((held, t) => Math.max(held, this.#lost[t]));
    this.#storages.fill(null);
    this.#underWay.clear();
    this.held.fill(0);
    this.bytes = 0;
  }
}
