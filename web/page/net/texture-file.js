// The downloaded beginning of a `.ptm`, and its levels, decoded in a worker.

import { PtmError } from "../../ptm/src/index.js";
import { levelSizes } from "../../client/src/levels.js";

/** @typedef {import("../../ptm/src/level-decoder.js").Image} Image */
/** @typedef {import("../../ptm/src/workers.js").Workers} Workers */

export class TextureFile {
  #bytes = new Uint8Array(0);
  /** Bytes received. */
  length = 0;

  /**
   * @param {import("../data/site.js").TextureRow} row
   * @param {Workers} workers
   */
  constructor(row, workers) {
    this.row = row;
    this.workers = workers;
  }

  /**
   * @param {number} begin at most `length`
   * @param {Uint8Array} part
   */
  append(begin, part) {
    const end = begin + part.length;
    if (end <= this.length) return;
    if (end > this.#bytes.length) {
      const size = this.row.ends[this.row.ends.length - 1];
      const grown = new Uint8Array(Math.min(Math.max(end, 2 * this.#bytes.length), size));
      grown.set(this.#bytes.subarray(0, this.length));
      this.#bytes = grown;
    }
    this.#bytes.set(part, begin);
    this.length = end;
  }

  /**
   * Forgets the bytes from `length` on.
   * @param {number} length
   */
  cut(length) {
    this.length = Math.min(this.length, length);
  }

  /**
   * The first levels. Throws PtmError with `level`, the damaged one.
   * @param {number} levels
   * @returns {Promise<Image[]>}
   */
  async decode(levels) {
    const { ends, components } = this.row, sizes = levelSizes(this.row);
    const format = components < 3 ? "native" : "rgba", channels = components < 3 ? components : 4;
    try {
      const bytes = this.#bytes.subarray(0, ends[levels - 1]);
      const images = await this.workers.decodeFirst(bytes, { ends, levels, format });
      const other = images.some((image, n) => image.channels !== channels
        || image.width !== sizes[n].width || image.height !== sizes[n].height);
      if (other) throw new PtmError("PTM-I105", "another file than the index says");
      return images;
    } catch (error) {
      const { decoded = 0 } = /** @type {{decoded?: number}} */ (error);
      throw Object.assign(/** @type {Error} */ (error), { level: decoded });
    }
  }
}
