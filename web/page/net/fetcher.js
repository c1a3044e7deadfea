// Requests for whole files and for ranges. Each answer is checked before use; a wrong one is requested
// again, with growing pauses.

import { PageError } from "./errors.js";
import { page } from "../words/english.js";
import { fill, spoken } from "../words/language.js";

/** Tries, and the pause before the second one, s; each pause is twice the one before. */
const TRIES = 6, FIRST_WAIT = 0.5;
/** Seconds without a byte after which a response is abandoned. */
export const PATIENCE = 20;

/** An error that another request may correct. */
class Passing extends Error {
  /**
   * @param {string} message
   * @param {boolean} [anew] whether the next request bypasses caches
   */
  constructor(message, anew = false) {
    super(message);
    this.anew = anew;
  }
}

/** Seconds on the clock of the page. */
export const clock = () => performance.now() / 1000;

export class Fetcher {
  /** @param {(message: string) => void} notice called once if the host ignores ranges */
  constructor(notice) {
    this.notice = notice;
    /** Receives of each answer the times of request, begin and end, s, and its bytes.
     * @type {((asked: number, began: number, ended: number, bytes: number) => void) | null} */
    this.measured = null;
    this.requests = 0;
    this.bytes = 0;
    this.pending = 0;
    this.ignoresRanges = false;
  }

  /**
   * A whole file, parsed. If it cannot be parsed, it is requested once more, bypassing caches: a
   * captive portal may have answered.
   * @template T
   * @param {string} url
   * @param {(body: Uint8Array<ArrayBuffer>) => T | Promise<T>} read throws or rejects if it is damaged
   * @param {{left: number}} [progress] bytes still to come, updated
   * @param {RequestCache} [cache] "no-store" for a file that was damaged
   * @returns {Promise<T>}
   */
  whole(url, read, progress, cache = "default") {
    return this.#persist(url, cache, progress, async (cache) => {
      const { response, body } = await this.#get(url, { cache }, progress);
      if (response.status !== 200) throw await refused(url, response.status);
      try {
        return await read(body);
      } catch (fault) {
        if (fault instanceof PageError) throw fault;
        const message = /** @type {Error} */ (fault).message;
        if (cache === "default") throw new Passing(message, true);
        throw new PageError("PTM-V105", fill(page.damaged, { file: nameOf(url), reason: message }));
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
   * @param {RequestCache} [cache] "no-store" for bytes that were damaged
   */
  range(url, begin, end, size, progress, cache = "default") {
    const range = `bytes=${begin}-${end - 1}`;
    return this.#persist(url, cache, progress, async (cache) => {
      const { response, body } = await this.#get(url, { cache, headers: { range } }, progress);
      if (response.status === 200) {
        if (body.length !== size) throw new Passing(`${body.length} of ${size} bytes`, true);
        this.#reportRanges();
        return { begin: 0, body };
      }
      if (response.status !== 206) throw await refused(url, response.status);
      // Hosts of other origins may hide the header.
      const answered = response.headers.get("content-range") ?? `bytes ${begin}-${end - 1}/${size}`;
      if (answered !== `bytes ${begin}-${end - 1}/${size}` || body.length !== end - begin) {
        throw new Passing(`${body.length} bytes, "${answered}", in place of ${range}`, true);
      }
      return { begin, body };
    });
  }

  #reportRanges() {
    if (this.ignoresRanges) return;
    this.ignoresRanges = true;
    console.warn("This host ignores byte ranges: each texture is downloaded whole before it is seen.");
    this.notice(page.slow);
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
        // No bytes are under way meanwhile.
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
    await spoken;
    throw new PageError("PTM-V104", fill(page.offline, { file: nameOf(url), reason }));
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
async function refused(url, status) {
  if (status >= 500 || status === 429 || status === 408) return new Passing(`status ${status}`);
  await spoken;
  const text = status === 404 ? page.missing : page.refused;
  return new PageError("PTM-V103", fill(text, { file: nameOf(url), reason: status }));
}

/** @param {string} url */
function nameOf(url) {
  return decodeURIComponent(new URL(url, location.href).pathname.split("/").pop() ?? url);
}

/** Waits, at most until the browser is online again. @param {number} seconds */
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
