// The downloaded beginning of a file: extended by range requests, one at a time, each of which goes on
// where the last one ended. Bytes of a broken or aborted request are kept.

/** Most failures of a request in a row, and the pause after the first, ms. */
const ATTEMPTS = 3;
const PAUSE = 500;
/** Rest of a response, bytes, that is awaited rather than aborted. */
const SHORT = 65536;

/** Hosts that were seen to ignore ranges. */
const rangeless = new Set();

/** An error that no further request corrects. */
class Unusable extends Error {}

/**
 * A response under way.
 * @typedef {object} Body
 * @property {ReadableStreamDefaultReader<Uint8Array>} reader
 * @property {number} at place of its next byte in the file
 * @property {number} end its end in the file
 * @property {boolean} all whether it is the whole file, regardless of the request
 */

/** See `read`. */
export class RangeFile {
  #bytes = new Uint8Array(0);
  #held = 0;
  #size = Infinity;
  /** Whether requests bypass caches. */
  #anew = false;
  /** @type {Body | undefined} */
  #body;
  /** @type {AbortController | undefined} */
  #control;
  /** @type {Promise<unknown>} */
  #turn = Promise.resolve();

  /** @param {string | URL} url */
  constructor(url) {
    this.url = new URL(url, globalThis.document?.baseURI);
    /** Least end of a request: set it before reading bytes below it. */
    this.until = 0;
  }

  /** Number of downloaded bytes. */
  get held() {
    return this.#held;
  }

  /**
   * Bytes of the file, as soon as they have arrived; fewer only where it ends. Calls take turns.
   * Rejects with the signal's reason, or with an Error that names the file.
   * @param {number} offset
   * @param {number} length
   * @param {AbortSignal} [signal]
   */
  async read(offset, length, signal) {
    await this.#inTurn(() => this.#fill(offset + length, signal));
    return this.#bytes.subarray(offset, Math.min(offset + length, this.#held));
  }

  /**
   * Releases the connection. A short rest of the response is awaited, so that it is not fetched again, and
   * the whole file if a host ignores ranges.
   * @param {AbortSignal} [signal]
   */
  settle(signal) {
    return this.#inTurn(async () => {
      const body = this.#body, short = body && (body.all || body.end - body.at <= SHORT);
      if (short && !signal?.aborted) await this.#fill(body.end, signal).catch(() => this.#stop());
      else this.#stop();
    });
  }

  /**
   * Drops the bytes from `offset` on, which are damaged: they are requested again.
   * @param {number} offset
   */
  forget(offset) {
    this.#stop();
    this.#held = Math.min(this.#held, offset);
    this.#anew = true;
  }

  /**
   * @template T
   * @param {() => Promise<T>} work
   * @returns {Promise<T>}
   */
  #inTurn(work) {
    const done = this.#turn.then(work);
    this.#turn = done.catch(() => {});
    return done;
  }

  /**
   * @param {number} end
   * @param {AbortSignal} [signal]
   */
  async #fill(end, signal) {
    const stop = () => this.#stop(signal?.reason);
    signal?.addEventListener("abort", stop);
    try {
      for (let failed = 0; this.#held < Math.min(end, this.#size); ) {
        signal?.throwIfAborted();
        try {
          await this.#more(Math.max(end, this.until));
          failed = 0;
        } catch (error) {
          this.#stop();
          signal?.throwIfAborted();
          if (error instanceof Unusable || ++failed === ATTEMPTS) throw error;
          this.#anew = true;
          await new Promise((resolve) => setTimeout(resolve, PAUSE * 2 ** (failed - 1)));
        }
      }
    } finally {
      signal?.removeEventListener("abort", stop);
    }
  }

  /**
   * The next piece of the response under way, or of a new one.
   * @param {number} end
   */
  async #more(end) {
    const body = (this.#body ??= await this.#request(end));
    if (!body) return;
    const { done, value } = await body.reader.read();
    if (value) this.#append(value, body);
    if (!done && body.at < body.end) return;
    if (body.at > body.end || (!done && !(await body.reader.read()).done)) {
      throw new Unusable(`${this.url}: more bytes than the server announced`);
    }
    this.#body = undefined;
    if (body.all) this.#size = body.at;
    else if (body.at < body.end) throw new Error(`${this.url}: the answer was cut short`);
    this.#anew = false;
  }

  /**
   * Appends the new bytes of a piece.
   * @param {Uint8Array} piece
   * @param {Body} body
   */
  #append(piece, body) {
    const fresh = piece.subarray(Math.max(this.#held - body.at, 0), body.end - body.at);
    body.at += piece.length;
    const held = this.#held + fresh.length;
    if (held > this.#bytes.length) {
      const grown = new Uint8Array(Math.max(held, Number.isFinite(body.end) ? body.end : 2 * held));
      grown.set(this.#bytes.subarray(0, this.#held));
      this.#bytes = grown;
    }
    this.#bytes.set(fresh, this.#held);
    this.#held = held;
  }

  /**
   * @param {number} end
   * @returns {Promise<Body | undefined>} nothing if the file ends before
   */
  async #request(end) {
    this.#control = new AbortController();
    const response = await fetch(this.url, {
      headers: { range: `bytes=${this.#held}-${Number.isFinite(end) ? end - 1 : ""}` },
      cache: this.#anew ? "no-store" : "default",
      signal: this.#control.signal,
    });
    const { status, headers, body } = response;
    const length = headers.get("content-length");
    const range = /^bytes (?:(\d+)-(\d+)|\*)\/(\d+|\*)$/.exec(headers.get("content-range") ?? "");
    if (status === 416 && range && Number(range[3]) <= this.#held) {
      this.#size = this.#held;
      return undefined;
    }
    if (!response.ok || !body) {
      const Kind = status === 429 || status >= 500 ? Error : Unusable;
      throw new Kind(`${this.url}: ${status} ${response.statusText}`);
    }
    const reader = body.getReader();
    if (status === 200) {
      if (!rangeless.has(this.url.host)) {
        rangeless.add(this.url.host);
        console.warn(`three-ptm: ${this.url.host} ignores byte ranges: its textures come whole`);
      }
      return { reader, at: 0, end: Infinity, all: true };
    }
    const [at, last] = [Number(range?.[1]), Number(range?.[2])];
    const right = status === 206 && at === this.#held && last >= at && last < end;
    if (!right || (length && Number(length) !== last + 1 - at)) {
      throw new Unusable(
        `${this.url}: asked for bytes from ${this.#held} on, the server answers ${status}, ` +
          `Content-Range ${headers.get("content-range")}, Content-Length ${length} ` +
          "(another host has to expose Content-Range)",
      );
    }
    const size = range?.[3] === "*" ? this.#size : Number(range?.[3]);
    if (this.#held && size !== this.#size) throw new Unusable(`${this.url}: it has changed`);
    this.#size = size;
    return { reader, at, end: last + 1, all: false };
  }

  /** @param {unknown} [reason] */
  #stop(reason) {
    this.#control?.abort(reason);
    this.#body = undefined;
  }
}
