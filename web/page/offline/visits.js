// The visits of a site: its page as it was last, what the visitor has seen of it, and what goes with a new version.

import { documentOf, isFile, isList, isSound, markOf, marksIn, nameOf, neededBy } from "./names.js";
import { missingOf } from "./spans.js";
import { isOwn } from "./store.js";

/** @typedef {import("./store.js").Store} Store */
/** @typedef {import("./store.js").Later} Later */
/** What a page has received, part of it before this script.
 * @typedef {object} Received
 * @property {string} index URL of the index
 * @property {string[]} files URLs of whole files
 * @property {{url: string, length: number}[]} ranged files that come in ranges, and the bytes received of each
 */

/** Of a page of `ptm publish`, and of one with `--offline`. */
const PAGE = 'id="site"', HOOK = /viewer-[0-9a-f]{10}\/register\.js/;
/** Of a catalogue. */
const CATALOGUE = '<meta name="generator" content="ptmtools">';
/** As if a host that cannot be reached had answered. */
const FAULT = 503;
/** Status 511 is the login of a network. @param {number} status */
const isFault = (status) => (status >= 500 && status !== 511) || status === 408 || status === 429;

/** A page of ours. No navigation may be answered with a response that was redirected. @param {string} html */
const pageOf = (html) => new Response(html, { headers: { "content-type": "text/html; charset=utf-8" } });

export class Visits {
  /** Pages are taken one after the other: each removes the files of those before. @type {Promise<unknown>} */
  #turn = Promise.resolve();

  /**
   * @param {Store} store @param {string} scope URL of the site, with a slash at its end
   * @param {() => Promise<unknown>} leave ends all of this: the site is no longer published so
   */
  constructor(store, scope, leave) {
    this.store = store;
    this.scope = scope;
    this.leave = leave;
  }

  /**
   * The answer to a request; null for one that is not the site's.
   * @param {Request} request @param {Later} later @returns {Promise<Response> | null}
   */
  answer(request, later) {
    const name = request.method === "GET" && !this.store.closed ? nameOf(request.url, this.scope) : null;
    if (name === null) return null;
    if (isFile(name)) return this.store.answer(request, this.scope + name, later);
    const document = documentOf(name);
    return document === null ? null : this.#document(request, name, document, later);
  }

  /**
   * As the host has it now; as it was, if the host does not answer or fails. An address without `.html` may also be
   * that of another file: it leaves the page, and removes nothing.
   * @param {Request} request @param {string} name in the address @param {string} document @param {Later} later
   */
  async #document(request, name, document, later) {
    const { store, scope } = this, key = scope + document, answer = store.ask(request);
    const status = await answer.then((response) => response.status, () => FAULT);
    if (isFault(status)) return (await store.match(key)) ?? answer;
    const response = await answer, own = !name || name.includes(".");
    if (status === 404 || status === 410) own && later(store.delete(key));
    else if (document) later(this.#take(key, response.clone()));
    else if (own) later(this.#learn(response.clone()));
    return response;
  }

  /** Takes a document besides the page. Networks that ask for a password answer for the host.
   * @param {string} key @param {Response} response */
  async #take(key, response) {
    if (!key.endsWith(".html")) return void (isOwn(response, key) && await this.store.put(key, response));
    const html = response.status === 200 ? await response.text() : "";
    if (html.includes(CATALOGUE)) await this.store.put(key, pageOf(html));
  }

  /** Takes a page as the last one, once its files are here. @param {Response} response */
  async #learn(response) {
    const html = response.status === 200 ? await response.text() : "";
    if (!html.includes(PAGE)) return;
    const work = this.#turn.then(() => this.#become(html));
    this.#turn = work.catch(() => {});
    return work;
  }

  /** @param {string} html */
  async #become(html) {
    const { store, scope } = this;
    if (!HOOK.test(html)) {
      store.closed = true;
      return void (await this.leave());
    }
    const before = await (await store.match(scope))?.text();
    if (!before) await store.begin();
    for (const name of neededBy(html)) {
      await this.#hold(scope + name);
      // Without room, what is kept of the former version stays.
      if (!(await store.match(scope + name))) return;
    }
    if (before === html) return;
    if (await store.put(scope, pageOf(html)) && before) await this.#tidy(html);
  }

  /** Fetches a file unless it is kept; rejects if it cannot be had. @param {string} url @param {number} [length] */
  async #hold(url, length) {
    if (length && !missingOf(await this.store.spans(url), { begin: 0, end: length })) return;
    /** @type {Promise<unknown>[]} */
    const work = [];
    const headers = length || isSound(url) ? { range: `bytes=0-${length ? length - 1 : ""}` } : undefined;
    const response = await this.store.answer(new Request(url, { headers }), url, (one) => work.push(one));
    await response.body?.cancel();
    if (!response.ok) throw new Error(`status ${response.status}`);
    await Promise.all(work);
  }

  /** Removes the documents that the page does not name, and the files that neither of them names.
   * @param {string} html */
  async #tidy(html) {
    const { store, scope } = this, named = new Set(marksIn(html));
    const all = (await store.keys()).map((key) => ({ key, name: nameOf(key, scope) ?? "" }));
    // A catalogue names those in other languages.
    const isNamed = (/** @type {string} */ name) => isFile(name) || html.includes(name.replace(/-.*\./, "."));
    for (const { key, name } of all) if (!isNamed(name)) await store.delete(key);
    const kept = all.filter(({ name }) => isNamed(name));
    // The index comes first, which names the others.
    for (const { key, name } of kept.sort((a, b) => (a.name < b.name ? -1 : 1))) {
      if (!isList(name) || (isFile(name) && !named.has(markOf(name)))) continue;
      for (const mark of marksIn((await (await store.match(key))?.text()) ?? "")) named.add(mark);
    }
    for (const { key, name } of kept) if (isFile(name) && !named.has(markOf(name))) await store.delete(key);
  }

  /** Keeps what a page has received. @param {Received} received */
  async keep({ index, files, ranged }) {
    const { store, scope } = this;
    const isHere = (/** @type {string} */ url) => isFile(nameOf(url, scope) ?? "");
    // The page of the host tells whether the site is still published so; the browser may have removed the storage.
    if (!(await store.match(scope))) await this.#learn(await store.ask(new Request(scope, { cache: "no-cache" })));
    if (!(await store.match(scope))) return;
    const own = files.filter(isHere);
    for (const url of own) await this.#hold(url).catch(() => {});
    for (const url of own) if (url.includes("/data/opening-")) await this.#unpack(url, index).catch(() => {});
    for (const { url, length } of ranged) if (isHere(url)) await this.#hold(url, length).catch(() => {});
  }

  /**
   * Keeps the parts of an opening as the files that they are: another view needs them, too
   * (docs/formats/hints.md). @param {string} url @param {string} index
   */
  async #unpack(url, index) {
    const { store } = this;
    const body = (await store.match(url))?.body?.pipeThrough(new DecompressionStream("gzip"));
    const bytes = new Uint8Array(await new Response(body).arrayBuffer());
    const { cells, textures } = await (await store.match(index))?.json();
    const length = new DataView(bytes.buffer).getUint32(0, true);
    const { parts } = JSON.parse(new TextDecoder().decode(bytes.subarray(4, 4 + length)));
    const previews = textures.flatMap((/** @type {any} */ row) => row.previews ?? []);
    let at = 4 + length;
    for (const [kind, number, size] of parts) {
      const part = bytes.slice(at, (at += size));
      const row = kind === "texture" ? textures[number] : kind === "preview" ? previews[number] : null;
      const file = new URL(row ? row.file : cells[number][kind], index).href;
      if (kind === "texture") {
        const span = { begin: 0, end: size };
        if (missingOf(await store.spans(file), span)) await store.keep(file, 0, part, row.ends.at(-1));
      } else if (!(await store.match(file))) {
        await store.put(file, new Response(part));
      }
    }
  }
}
