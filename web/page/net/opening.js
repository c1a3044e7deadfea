// An opening of a site: small files of a view, and beginnings of textures, which come with the page in one
// gzip stream (docs/formats/hints.md). Each is a file of its own, too, so an opening that fails
// costs nothing but time, and nobody reads its errors.

import { PATIENCE } from "./fetcher.js";

/** @typedef {Uint8Array<ArrayBuffer>} Bytes */
/** @typedef {import("../policy/downloads.js").Kind} Kind */

/**
 * A result; rejects if it takes too long.
 * @template R
 * @param {Promise<R>} result
 * @returns {Promise<R>}
 */
const patiently = (result) =>
  Promise.race([result, new Promise((_, fail) => setTimeout(fail, 1000 * PATIENCE))]);

/** Returns the next bytes of a stream as they arrive; rejects if it ends before. @param {ReadableStream<Bytes>} stream */
function arriving(stream) {
  const reader = stream.getReader();
  let bytes = new Uint8Array(0);
  return async (/** @type {number} */ count) => {
    while (bytes.length < count) {
      const { value } = await patiently(reader.read());
      if (!value) throw new Error();
      bytes = new Uint8Array(await new Blob([bytes, value]).arrayBuffer());
    }
    const taken = bytes.slice(0, count);
    bytes = bytes.subarray(count);
    return taken;
  };
}

export class Opening {
  /** Kind, number and bytes of each part, once known. @type {[Kind, number, number][]} */
  parts = [];
  /** Compressed bytes received. */
  bytes = 0;
  /** By kind and number. @type {Map<string, Promise<Bytes | null>>} */
  #coming = new Map();

  /** @param {string} url @param {boolean} here whether the visitor begins with its view */
  constructor(url, here) {
    this.url = url;
    /**
     * The previews that the view needs next, each with the lines of the largest screen that does not need it,
     * once all parts are known; null elsewhere, and of an opening that fails.
     * @type {Promise<[number, number][] | null>}
     */
    this.next = this.#open(url, here).catch(() => null);
  }

  /** @param {string} url @param {boolean} here @returns {Promise<[number, number][] | null>} */
  async #open(url, here) {
    const { body } = await patiently(fetch(url));
    /** @type {TransformStream<Bytes, Bytes>} */
    const counted = new TransformStream({
      transform: (chunk, after) => {
        this.bytes += chunk.length;
        after.enqueue(chunk);
      },
    });
    // What is no opening cannot be unpacked, either.
    const packed = /** @type {ReadableStream<Bytes>} */ (body);
    const take = arriving(packed.pipeThrough(counted).pipeThrough(new DecompressionStream("gzip")));
    const length = new DataView((await take(4)).buffer).getUint32(0, true);
    const { parts, next } = JSON.parse(new TextDecoder().decode(await take(length)));
    /** @type {Promise<unknown>} */
    let last = Promise.resolve();
    for (const [kind, number, size] of parts) {
      const part = last.then(() => take(size));
      this.#coming.set(kind + number, part.catch(() => null));
      last = part;
    }
    this.parts = parts;
    return here ? next : null;
  }

  /**
   * The bytes of a part, once they are here; nothing if it has no such part.
   * @param {Kind} kind
   * @param {number} number
   */
  async take(kind, number) {
    await this.next;
    return this.#coming.get(kind + number);
  }
}
