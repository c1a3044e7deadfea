// The files of a site that a browser keeps: whole ones, and spans of those that come in ranges. Names change with
// contents, so what is kept is right for ever; a file that was damaged is asked for with `no-store` and replaced.

import { isSound } from "./names.js";
import { answeredSpan, askedSpan, bytesOf, coverOf, keyOf, missingOf, rangeOf, spanOfKey } from "./spans.js";

/** @typedef {import("./spans.js").Span} Span */
/** @typedef {Span & {total: number, key: string}} Kept */
/** @typedef {(work: Promise<unknown>) => void} Later what goes on after the answer */
/** The part of a browser's `Cache` that is used.
 * @typedef {object} Shelf
 * @property {(key: string, options?: CacheQueryOptions) => Promise<Response | undefined>} match
 * @property {(key: string, response: Response) => Promise<void>} put
 * @property {(key: string) => Promise<boolean>} delete
 * @property {() => Promise<readonly {url: string}[]>} keys
 */

const PAST = ["no-store", "reload"];
/** Bytes of the longest sound that is kept. */
const LONGEST = 8 * 2 ** 20;
/** What hosts say `Vary` about does not differ for one page. */
const ANY = { ignoreVary: true };

/** Media types of files by the ends of their names. @type {Record<string, RegExp>} */
const TYPES = { js: /javascript/, json: /json/, wasm: /wasm|octet-stream/ };

/** Whether an answer is the file: hosts of applications answer with their page for files that they lack, and
 * networks with texts of their own. @param {Response} response @param {string} url */
export function isOwn({ status, headers }, url) {
  const type = headers.get("content-type") ?? "";
  return status === 200 && (TYPES[url.split(".").at(-1) ?? ""] ?? /^(?!text\/html)/).test(type);
}

/** Whether an answer is the file or a range of it, and not of a long sound.
 * @param {Response} response @param {string} url */
function isKept(response, url) {
  const { status, headers } = response;
  const total = answeredSpan(headers.get("content-range"))?.total, length = headers.get("content-length");
  if (status === 206 ? !total : !isOwn(response, url)) return false;
  return !isSound(url) || Number(total ?? length ?? Infinity) <= LONGEST;
}

export class Store {
  /** The spans of files, by URL. @type {Promise<Map<string, Kept[]>> | null} */
  #spans = null;
  /** Whether nothing is kept any more. */
  closed = false;

  /** @param {(create?: boolean) => Promise<Shelf>} open rejects if there is no cache, and it is not to be created
   * @param {(request: Request | string) => Promise<Response>} ask the host */
  constructor(open, ask) {
    this.open = open;
    this.ask = ask;
  }

  /** Creates the storage, also after its removal. */
  async begin() {
    await this.open(true);
    this.closed = false;
    this.#spans = null;
  }

  /** Keeps an answer; without room, nothing happens. @param {string} key @param {Response} response */
  async put(key, response) {
    try {
      if (this.closed) return false;
      await (await this.open()).put(key, response);
      return true;
    } catch {
      return false;
    }
  }

  /** @param {string} key */
  async match(key) {
    return this.#tried((shelf) => shelf.match(key, ANY), undefined);
  }

  /** @param {string} key */
  async delete(key) {
    const span = spanOfKey(key);
    if (span) {
      const spans = await this.#all(), rows = spans.get(span.url) ?? [];
      spans.set(span.url, rows.filter((row) => row.key !== key));
    }
    return this.#tried((shelf) => shelf.delete(key), false);
  }

  async keys() {
    return (await this.#tried((shelf) => shelf.keys(), [])).map(({ url }) => url);
  }

  /** Storage that fails is as good as empty: the host has it all.
   * @template T
   * @param {(shelf: Shelf) => Promise<T>} work @param {T} otherwise */
  async #tried(work, otherwise) {
    try {
      // Opening makes a cache anew.
      return this.closed ? otherwise : await work(await this.open());
    } catch {
      return otherwise;
    }
  }

  #all() {
    const read = async () => {
      /** @type {Map<string, Kept[]>} */
      const spans = new Map();
      for (const key of await this.keys()) {
        const span = spanOfKey(key);
        if (span) spans.set(span.url, [...(spans.get(span.url) ?? []), { ...span, key }]);
      }
      return spans;
    };
    return (this.#spans ??= read());
  }

  /** @param {string} url */
  async spans(url) {
    return (await this.#all()).get(url) ?? [];
  }

  /**
   * Keeps bytes of a file, in place of spans that they have.
   * @param {string} url @param {number} begin @param {Uint8Array<ArrayBuffer>} bytes
   * @param {number} total bytes of the file @param {string | null} [type] of the file
   */
  async keep(url, begin, bytes, total, type) {
    const span = { begin, end: begin + bytes.length }, key = keyOf(url, span, total);
    const response = new Response(bytes, { headers: type ? { "content-type": type } : {} });
    if (!bytes.length || !(await this.put(key, response))) return;
    const all = await this.#all(), rows = all.get(url) ?? [];
    const within = rows.filter((row) => row.key !== key && row.begin >= begin && row.end <= span.end);
    all.set(url, [...rows.filter((row) => row.key !== key && !within.includes(row)), { ...span, total, key }]);
    for (const row of within) await this.#tried((shelf) => shelf.delete(row.key), false);
  }

  /**
   * The answer to a request for a file, or a range of it: of what is kept, and of the host what is missing.
   * Rejects as the host does.
   * @param {Request} request @param {string} url without a query @param {Later} later
   */
  async answer(request, url, later) {
    const header = request.headers.get("range"), span = askedSpan(header);
    const past = PAST.includes(request.cache);
    if (span) return this.#range(request, url, span, past, later);
    const kept = past || header ? null : await this.match(url);
    if (kept) return kept;
    const response = await this.ask(request);
    if (isKept(response, url)) later(this.put(url, response.clone()));
    return response;
  }

  /** @param {Request} request @param {string} url @param {Span} wanted @param {boolean} past @param {Later} later */
  async #range(request, url, wanted, past, later) {
    const spans = past ? [] : await this.spans(url);
    const span = { begin: wanted.begin, end: Math.min(wanted.end, spans[0]?.total ?? Infinity) };
    // A player does not wait for a part of its range.
    const gap = missingOf(spans, span), none = gap && (isSound(url) || (gap.begin === span.begin && gap.end === span.end));
    if (gap && !none) {
      /** @type {Promise<unknown>[]} */
      const work = [];
      // The host may redirect to another origin.
      const rest = new Request(request, { mode: "cors", headers: { range: rangeOf(gap) } });
      const response = await this.#fetched(rest, url, past, (one) => later((work.push(one), one)));
      if (response.status !== 206) return response;
      await Promise.all(work);
    }
    return (none ? null : await this.#composed(url, span)) ?? this.#fetched(request, url, past, later);
  }

  /** The host's answer, of which the bytes are kept. Hosts that ignore ranges send the file.
   * @param {Request} request @param {string} url @param {boolean} past @param {Later} later */
  async #fetched(request, url, past, later) {
    const response = await this.ask(request);
    const span = response.status === 206 ? answeredSpan(response.headers.get("content-range")) : null;
    if (isKept(response, url)) later(this.#store(response.clone(), url, span, past));
    return response;
  }

  /**
   * @param {Response} response @param {string} url
   * @param {Span & {total: number} | null} span null for the file; @param {boolean} past whether others are wrong
   */
  async #store(response, url, span, past) {
    const bytes = new Uint8Array(await response.arrayBuffer());
    const { begin, end, total } = span ?? { begin: 0, end: bytes.length, total: bytes.length };
    if (bytes.length !== end - begin) return;
    if (past) {
      const wrong = (await this.spans(url)).filter((row) => row.begin < end && row.end > begin);
      for (const row of wrong) await this.delete(row.key);
    }
    await this.keep(url, begin, bytes, total, response.headers.get("content-type"));
  }

  /** A range of what is kept; null if bytes of it have gone. @param {string} url @param {Span} span */
  async #composed(url, span) {
    const cover = coverOf(await this.spans(url), span), parts = [];
    let type = "";
    for (const { key, begin } of cover) {
      const kept = await this.match(key);
      if (!kept) {
        await this.delete(key);
        return null;
      }
      type = kept.headers.get("content-type") ?? "";
      parts.push({ begin, bytes: new Uint8Array(await kept.arrayBuffer()) });
    }
    if (!cover.length) return null;
    const headers = {
      "content-range": `bytes ${span.begin}-${span.end - 1}/${cover[0].total}`,
      "content-length": String(span.end - span.begin), "content-type": type,
    };
    return new Response(bytesOf(parts, span), { status: 206, headers });
  }
}
