// Requests: whole files, and ranges of files. Each answer is checked before anybody sees it, and asked
// for again, ever more slowly, if it is not what it should be.

import { PageError } from "./errors.js";

/** Tries, and seconds until the second one; each waits twice as long as the one before. */
const TRIES = 6, FIRST_WAIT = 0.5;
/** Seconds without a byte after which an answer is given up. */
const PATIENCE = 20;

/** A fault that asking again may mend. */
class Passing extends Error {
  /**
   * @param {string} message
   * @param {boolean} [anew] whether caches are to be passed by
   */
  constructor(message, anew = false) {
    super(message);
    this.anew = anew;
  }
}

/** Seconds, of the clock that all of the page goes by. */
export const clock = () => performance.now() / 1000;

export class Fetcher {
  /** @param {(message: string) => void} notice told once that the host ignores ranges */
  constructor(notice) {
    this.notice = notice;
    /** Told of each answer: when, s, it was asked for, began and ended, and how many bytes it had.
     * @type {((asked: number, began: number, ended: number, bytes: number) => void) | null} */
    this.measured = null;
    this.requests = 0;
    this.bytes = 0;
    this.pending = 0;
    this.ignoresRanges = false;
  }

  /**
   * What is made of all of a file. If nothing can be made of it, it is asked for once more, past the
   * cache: it may be a page that somebody put in its place.
   * @template T
   * @param {string} url
   * @param {(body: Uint8Array<ArrayBuffer>) => T} read throws if it is damaged
   * @param {{left: number}} [progress] told what is still to come
   * @returns {Promise<T>}
   */
  whole(url, read, progress) {
    return this.#persist(url, "default", progress, async (cache) => {
      const { response, body } = await this.#get(url, { cache }, progress);
      if (response.status !== 200) throw refused(url, response.status);
      try {
        return read(body);
      } catch (fault) {
        const message = /** @type {Error} */ (fault).message;
        if (cache === "default") throw new Passing(message, true);
        throw new PageError("PTM-V105", `${nameOf(url)} is damaged: ${message}`);
      }
    });
  }

  /**
   * Bytes `begin` to `end` of a file of `size` bytes; all of it from a host that ignores ranges.
   * @param {string} url
   * @param {number} begin
   * @param {number} end
   * @param {number} size
   * @param {{left: number}} [progress]
   * @param {RequestCache} [cache] "no-store" for what was found to be damaged
   */
  range(url, begin, end, size, progress, cache = "default") {
    const range = `bytes=${begin}-${end - 1}`;
    return this.#persist(url, cache, progress, async (cache) => {
      const { response, body } = await this.#get(url, { cache, headers: { range } }, progress);
      if (response.status === 200) {
        if (body.length !== size) throw new Passing(`${body.length} of ${size} bytes`, true);
        this.#tell();
        return { begin: 0, body };
      }
      if (response.status !== 206) throw refused(url, response.status);
      // Hosts of other origins may hide it.
      const told = response.headers.get("content-range") ?? `bytes ${begin}-${end - 1}/${size}`;
      if (told !== `bytes ${begin}-${end - 1}/${size}` || body.length !== end - begin) {
        throw new Passing(`${body.length} bytes, "${told}", in place of ${range}`, true);
      }
      return { begin, body };
    });
  }

  #tell() {
    if (this.ignoresRanges) return;
    this.ignoresRanges = true;
    console.warn("This host ignores byte ranges: each texture is downloaded whole before it is seen.");
    this.notice("Textures load slowly here: the server does not support range requests.");
  }

  /**
   * @template T
   * @param {string} url
   * @param {RequestCache} cache
   * @param {{left: number} | undefined} progress
   * @param {(cache: RequestCache) => Promise<T>} ask
   * @returns {Promise<T>}
   */
  async #persist(url, cache, progress, ask) {
    const left = progress?.left ?? 0;
    let reason = "";
    for (let tried = 0; tried < TRIES; tried++) {
      if (tried) {
        // Nothing is on the way meanwhile.
        if (progress) Object.assign(progress, { left: 0, waits: true });
        await wait(FIRST_WAIT * 2 ** (tried - 1));
      }
      if (progress) Object.assign(progress, { left, waits: false });
      this.pending++;
      try {
        return await ask(cache);
      } catch (error) {
        if (error instanceof PageError) throw error;
        if (error instanceof Passing && error.anew) cache = "no-store";
        reason = String(/** @type {Error} */ (error).message);
      } finally {
        this.pending--;
      }
    }
    throw new PageError("PTM-V104", `${nameOf(url)} cannot be downloaded: ${reason}`);
  }

  /**
   * @param {string} url
   * @param {RequestInit} options
   * @param {{left: number}} [progress]
   */
  async #get(url, options, progress) {
    this.requests++;
    const giveUp = new AbortController();
    const late = new Passing(`nothing came for ${PATIENCE} s`);
    let timer = setTimeout(() => giveUp.abort(late), 1000 * PATIENCE);
    try {
      const asked = clock();
      const response = await fetch(url, { ...options, signal: giveUp.signal });
      const began = clock();
      const reader = response.body?.getReader();
      /** @type {Uint8Array[]} */
      const parts = [];
      for (;;) {
        const { done, value } = (await reader?.read()) ?? { done: true, value: undefined };
        if (done || !value) {
          const body = joined(parts);
          this.measured?.(asked, began, clock(), body.length);
          return { response, body };
        }
        clearTimeout(timer);
        timer = setTimeout(() => giveUp.abort(late), 1000 * PATIENCE);
        parts.push(value);
        this.bytes += value.length;
        if (progress) progress.left -= value.length;
      }
    } finally {
      clearTimeout(timer);
    }
  }
}

/** @param {Uint8Array[]} parts */
function joined(parts) {
  const body = new Uint8Array(parts.reduce((sum, { length }) => sum + length, 0));
  let at = 0;
  for (const part of parts) {
    body.set(part, at);
    at += part.length;
  }
  return body;
}

/**
 * @param {string} url
 * @param {number} status
 */
function refused(url, status) {
  if (status >= 500 || status === 429 || status === 408) return new Passing(`status ${status}`);
  const what = status === 404 ? "is missing" : `is refused with status ${status}`;
  return new PageError("PTM-V103", `${nameOf(url)} ${what} on this site`);
}

/** @param {string} url */
function nameOf(url) {
  return decodeURIComponent(new URL(url, location.href).pathname.split("/").pop() ?? url);
}

/** Waits, or until there is a connection again. @param {number} seconds */
function wait(seconds) {
  return new Promise((resolve) => {
    const done = () => {
      clearTimeout(timer);
      removeEventListener("online", done);
      resolve(undefined);
    };
    const timer = setTimeout(done, 1000 * seconds);
    addEventListener("online", done);
  });
}
