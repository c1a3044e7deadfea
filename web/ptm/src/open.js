// Reads a file range by range, as far as the wanted levels.

import { readHeader } from "./container.js";
import { loadEngine } from "./engine.js";
import { PtmError } from "./errors.js";
import { LevelDecoder } from "./level-decoder.js";

/** @typedef {import("./level-decoder.js").Image} Image */

/**
 * Returns `length` bytes of a file from an offset on; fewer only where the file ends.
 * @typedef {(offset: number, length: number, signal?: AbortSignal)
 *   => Promise<Uint8Array | ArrayBuffer>} ReadRange
 */

/**
 * @typedef {object} OpenOptions
 * @property {AbortSignal} [signal]
 * @property {number} [first] bytes of the first range: the head and, mostly, some coarse levels
 */

/**
 * @typedef {import("./level-decoder.js").DecoderOptions & {
 *   to?: number,
 *   signal?: AbortSignal,
 *   engine?: import("./engine.js").Engine,
 *   workers?: import("./remote-decoder.js").DecoderWorkers,
 * }} DecodeOptions
 *   `to`: the finest level that is wanted; it is an error then if it is not whole in the file.
 *   `workers` or, without them, `engine` decode; by default this thread, by `loadEngine`.
 */

/** Bytes that are read at first: a customary page, no more than a packet or three. */
const FIRST = 4096;

/**
 * Reads the head of a file. Throws as `readHeader` and `read` do.
 * @param {ReadRange} read
 * @param {OpenOptions} [options]
 */
export async function openPtm(read, { signal, first = FIRST } = {}) {
  signal?.throwIfAborted();
  const begin = bytesOf(await read(0, first, signal));
  return new Ptm(read, begin);
}

/** An open file; see `openPtm`. */
export class Ptm {
  #read;
  #begin;

  /**
   * @param {ReadRange} read
   * @param {Uint8Array} begin its first bytes, with all of the head
   */
  constructor(read, begin) {
    this.#read = read;
    this.#begin = begin;
    this.header = readHeader(begin);
  }

  /** Coarsest first. */
  get levels() {
    return this.header.levels;
  }

  /**
   * The bytes of a level's group; those of levels that follow one another do so too.
   * @param {number} level
   */
  rangeOf(level) {
    const group = this.levels[level];
    if (!group) throw new PtmError("PTM-I111", `there is no level ${level}`);
    return { offset: group.offset, length: group.length };
  }

  /**
   * Images of the levels, coarsest first, each as soon as its bytes are there. Without `to` a file
   * that is cut ends with its last whole level.
   * @param {DecodeOptions} [options]
   * @returns {AsyncGenerator<Image, void, void>}
   */
  async *decode({ to, signal, engine, workers, ...options } = {}) {
    if (to !== undefined) this.rangeOf(to);
    const decoder = workers
      ? workers.decoder(this.header, options)
      : new LevelDecoder(this.header, engine ?? (await loadEngine()), options);
    try {
      for (const [number, level] of this.levels.entries()) {
        if (number > (to ?? number)) return;
        const data = await this.#range(level.offset, level.length, signal);
        if (data.length < level.length) {
          if (to === undefined) return;
          throw new PtmError("PTM-I103", `level ${to} is not whole; the last that is: ${number - 1}`);
        }
        yield await decoder.refine(data, { signal });
      }
    } finally {
      if ("close" in decoder) decoder.close();
    }
  }

  /**
   * The image of one level.
   * @param {number} level
   * @param {DecodeOptions} [options]
   */
  async image(level, options = {}) {
    let last;
    for await (const image of this.decode({ ...options, to: level })) last = image;
    return /** @type {Image} */ (last);
  }

  /**
   * Bytes of the file; the first range is not read again.
   * @param {number} offset
   * @param {number} length
   * @param {AbortSignal} [signal]
   */
  async #range(offset, length, signal) {
    signal?.throwIfAborted();
    const known = this.#begin.subarray(offset, offset + length);
    if (known.length === length) return known;
    const more = bytesOf(await this.#read(offset + known.length, length - known.length, signal));
    if (!known.length) return more;
    const data = new Uint8Array(known.length + more.length);
    data.set(known);
    data.set(more, known.length);
    return data;
  }
}

/** @param {Uint8Array | ArrayBuffer} bytes */
function bytesOf(bytes) {
  return bytes instanceof Uint8Array ? bytes : new Uint8Array(bytes);
}
