// An opening of a site: small files of a view, and beginnings of textures, which come with the page in one
// gzip stream (docs/formats/hints.md). Each is a file of its own, too, so an opening that fails
// costs nothing but time, and nobody reads its errors.

import { PATIENCE } from "./fetcher.js";

/** @typedef {Uint8Array<ArrayBuffer>} Bytes */
/** @typedef {import("../policy/downloads.js").Kind} Kind */

/**
 * A result; throws if it takes too long.
 * @template R
 * @param {Promise<R>} result
 * @returns {Promise<R>}
 */
function patiently(result) {
  return Promise.race([result, new Promise((_, fail) => {
    setTimeout(() => fail(new Error()), 1000 * PATIENCE);
  })]);
}

/** The bytes of a stream as they arrive. */
class Arriving {
  #bytes = new Uint8Array(0);
  #reader;

  /** @param {ReadableStream<Bytes>} body */
  constructor(body) {
    this.#reader = body.getReader();
  }

  /** The next bytes; throws if the response ends before. @param {number} count @returns {Promise<Bytes>} */
  async take(count) {
    while (this.#bytes.length < count) {
      const { done, value } = await patiently(this.#reader.read());
      if (done) throw new Error();
      this.#bytes = new Uint8Array(await new Blob([this.#bytes, value]).arrayBuffer());
    }
    const taken = this.#bytes.slice(0, count);
    this.#bytes = this.#bytes.subarray(count);
    return taken;
  }
}

export class Opening {
  /** Kind, number and bytes of each part, once known. @type {[Kind, number, number][]} */
  parts = [];
  /** Bytes of the answer, as the host states them. */
  bytes = 0;
  /** By kind and number. @type {Map<string, Promise<Bytes | null>>} */
  #coming = new Map();

  /** @param {string} url */
  constructor(url) {
    this.url = url;
    const arriving = this.#open(url);
    /**
     * The previews that the view needs next, each with the lines of the largest screen that does not need it,
     * once all parts are known.
     * @type {Promise<[number, number][]>}
     */
    this.next = arriving.then(({ next }) => next, () => []);
    /** Resolved when all parts are here, or no more will come. @type {Promise<void>} */
    this.over = arriving.then(({ last }) => last).then(() => {}, () => {});
  }

  /** @param {string} url @returns {Promise<{last: Promise<unknown>, next: [number, number][]}>} */
  async #open(url) {
    const { ok, body, headers } = await patiently(fetch(url));
    if (!ok || !body) throw new Error();
    this.bytes = Number(headers.get("content-length"));
    const bytes = new Arriving(body.pipeThrough(new DecompressionStream("gzip")));
    const length = new DataView((await bytes.take(4)).buffer).getUint32(0, true);
    const { parts, next } = JSON.parse(new TextDecoder().decode(await bytes.take(length)));
    /** @type {Promise<unknown>} */
    let last = Promise.resolve();
    for (const [kind, number, size] of parts) {
      const part = last.then(() => bytes.take(size));
      this.#coming.set(kind + number, part.catch(() => null));
      last = part;
    }
    this.parts = parts;
    return { last, next };
  }

  /**
   * The bytes of a part, once they are here; null if it has no such part.
   * @param {Kind} kind
   * @param {number} number
   */
  async take(kind, number) {
    await this.next;
    return (await this.#coming.get(kind + number)) ?? null;
  }
}
