// Texture memory of a page without levels of detail, for the policy `whole`: each texture is uploaded
// whole when it is drawn and is not there; the least recently drawn ones make room. If what is in view
// does not fit, each picture uploads most of it again. Pages leave this to the driver, which does the
// same where its memory ends; what has been decoded stays in main memory, as drivers keep it.

import { Lru } from "../policy/lru.js";
import { Storage } from "./storage.js";

/** @typedef {import("./texture-memory.js").Decode} Decode */
/** @typedef {import("./texture-memory.js").Decoded} Decoded */
/** @typedef {import("./texture-memory.js").Row} Row */

/** @typedef {import("./renderer.js").Textures} Textures */

/** @implements {Textures} */
export class WholeMemory {
  /** @type {Map<number, Decoded>} */
  #decoded = new Map();
  /** @type {Map<number, Storage>} */
  #storages = new Map();
  /** Textures that are drawn and not decoded. @type {Set<number>} */
  #lacking = new Set();
  /** @type {Set<number>} */
  #decoding = new Set();
  #news = false;
  #lru = new Lru((t) => {
    this.#storages.get(t)?.delete();
    this.#storages.delete(t);
  });

  /**
   * @param {WebGL2RenderingContext} gl
   * @param {Row[]} rows
   * @param {Decode} decode
   */
  constructor(gl, rows, decode) {
    this.gl = gl;
    this.rows = rows;
    this.decode = decode;
    /** Levels of each texture that a drawing shows, in texture memory or uploaded for it. */
    this.held = new Int32Array(rows.length);
    this.loss = new Float64Array(rows.length);
    this.budget = Infinity;
    this.peak = 0;
    /** It has nothing to fade. */
    this.fades = true;
  }

  get bytes() {
    return this.#lru.bytes;
  }

  /** The texture, for drawing it now: what is missing is uploaded. @param {number} texture */
  of(texture) {
    const decoded = this.#decoded.get(texture), { sizes, channels, offsets } = this.rows[texture];
    if (!decoded) {
      this.#lacking.add(texture);
      return null;
    }
    const bytes = sizes.reduce((sum, { width, height }) => sum + width * height * channels, 0);
    if (!this.#lru.use(texture, bytes, this.budget)) return null;
    this.peak = Math.max(this.peak, this.bytes);
    const present = this.#storages.get(texture);
    if (present) return present;
    const storage = new Storage(this.gl, sizes, channels);
    decoded.images.forEach(({ data, height }, level) => {
      for (let row = 0; row < height;) row = storage.upload(level, data, row, offsets[level]);
    });
    this.#storages.set(texture, storage);
    return storage;
  }

  /**
   * Decodes what the last pictures lacked, what is in view, and what has a better source.
   * @param {Int32Array} want columns
   * @param {Float64Array} priority
   * @param {Float64Array} loss of the best source of each
   */
  settle(want, priority, loss) {
    this.#lru.shrink(this.budget);
    want.forEach((levels, t) => {
      // Behind a poster nothing is drawn until what is in view has been decoded.
      const news = this.#decoded.has(t) ? loss[t] < this.loss[t] : priority[t] > 0;
      if (levels > 0 && news) this.#lacking.add(t);
    });
    const lacking = [...this.#lacking].sort((a, b) => priority[b] - priority[a]);
    this.#lacking.clear();
    for (const t of lacking) {
      if (this.#decoding.has(t)) continue;
      this.#decoding.add(t);
      this.decode(t, this.rows[t].sizes.length)
        // Otherwise it is not here yet.
        .then((decoded) => this.#keep(t, decoded), () => this.#lacking.add(t))
        .finally(() => this.#decoding.delete(t));
    }
  }

  /** @param {number} t @param {Decoded} decoded */
  #keep(t, decoded) {
    this.#lru.drop(t);
    this.#decoded.set(t, decoded);
    this.held[t] = decoded.images.length;
    this.loss[t] = decoded.loss;
    this.#news = true;
  }

  /** Whether there is more to draw than before. */
  pump() {
    const news = this.#news;
    this.#news = false;
    return news;
  }

  /** What is drawn is as before. */
  hold() {}

  /** The next picture uploads what it needs. */
  resume() {}

  delete() {
    this.#decoded.clear();
    this.held.fill(0);
    this.#lru.shrink(0);
  }

  /** Storages are gone with the context. */
  lose() {
    this.#lru.shrink(0);
  }
}
