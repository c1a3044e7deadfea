// An opening of a site: small files of a view, and beginnings of textures, which come with the page in one
// file (docs/formats/hints.md). Each is a file of its own, too, so an opening that fails
// costs nothing but time.

import { PATIENCE } from "./fetcher.js";

/** @typedef {Uint8Array<ArrayBuffer>} Bytes */
/** @typedef {import("../policy/downloads.js").Kind} Kind */

/** Kinds that are compressed in it. */
const PACKED = ["record", "geometry"];

/**
 * A result; throws if it takes too long.
 * @template R
 * @param {Promise<R>} result
 * @returns {Promise<R>}
 */
async function patiently(result) {
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let timer;
  const late = new Promise((_, fail) => {
    timer = setTimeout(() => fail(new Error("nothing came")), 1000 * PATIENCE);
  });
  try {
    return /** @type {R} */ (await Promise.race([result, late]));
  } finally {
    clearTimeout(timer);
  }
}

/** The bytes of a response as they arrive. */
class Arriving {
  /** All that have come. */
  count = 0;
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
      if (done) throw new Error("is cut short");
      this.count += value.length;
      const longer = new Uint8Array(this.#bytes.length + value.length);
      longer.set(this.#bytes);
      longer.set(value, this.#bytes.length);
      this.#bytes = longer;
    }
    const taken = this.#bytes.slice(0, count);
    this.#bytes = this.#bytes.subarray(count);
    return taken;
  }
}

export class Opening {
  /** Kind, number and bytes of each part, once known. @type {[Kind, number, number][]} */
  parts = [];
  /** Bytes received. */
  bytes = 0;
  /** By kind and number. @type {Map<string, (part: Bytes | null) => void>} */
  #waiting = new Map();
  /** @type {Map<string, Promise<Bytes | null>>} */
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
    this.over = arriving
      .then(async ({ bytes }) => {
        for (const [kind, number, size] of this.parts) {
          const part = await bytes.take(size);
          this.bytes = bytes.count;
          this.#waiting.get(kind + number)?.(PACKED.includes(kind) ? await unpacked(part) : part);
        }
      })
      .catch(() => {})
      .finally(() => this.#waiting.forEach((come) => come(null)));
  }

  /** @param {string} url @returns {Promise<{bytes: Arriving, next: [number, number][]}>} */
  async #open(url) {
    const { ok, body } = await patiently(fetch(url));
    if (!ok || !body) throw new Error("cannot be downloaded");
    const bytes = new Arriving(/** @type {ReadableStream<Bytes>} */ (body));
    const length = new DataView((await bytes.take(4)).buffer).getUint32(0, true);
    const { parts, next } = JSON.parse(new TextDecoder().decode(await bytes.take(length)));
    for (const [kind, number] of parts) {
      const key = kind + number;
      this.#coming.set(key, new Promise((come) => this.#waiting.set(key, come)));
    }
    this.parts = parts;
    return { bytes, next };
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

/** @param {Bytes} part @returns {Promise<Bytes>} */
async function unpacked(part) {
  const stream = new Blob([part]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}
