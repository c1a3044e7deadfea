// Requests to `ptm serve --edit`. The token is in the fragment of the printed address: it is kept for
// reloads of this tab, and leaves the address, which visitors copy.

const KEPT = "ptm-edit-token";

/** @typedef {import("../tour/document.js").Document} Shown */
/**
 * @typedef {object} Loaded
 * @property {any} document of the tour
 * @property {string} tag
 * @property {Shown} shown
 * @property {string} file
 * @property {string[]} rooms
 * @property {string[]} places names of the viewpoints
 * @property {string[]} sounds
 * @property {string[]} captions
 */
/** @typedef {{object: string, at: number[]}} Pick */

/** A refusal of the server: its status, and what is wrong where. */
export class Refusal extends Error {
  /** @param {number} status @param {{message?: string, place?: string, remedy?: string, code?: string}} body */
  constructor(status, body) {
    super(body.message ?? `status ${status}`);
    this.status = status;
    this.place = body.place ?? "";
    this.remedy = body.remedy ?? "";
    this.code = body.code ?? "";
  }
}

/** The token of the address, else that of this tab. */
export function tokenOf() {
  const given = /^#token=([\w-]+)$/.exec(location.hash)?.[1];
  try {
    if (given) sessionStorage.setItem(KEPT, given);
    return given ?? sessionStorage.getItem(KEPT) ?? "";
  } catch {
    return given ?? "";
  } finally {
    if (given) history.replaceState(null, "", location.pathname + location.search);
  }
}

export class Server {
  /** @param {string} token */
  constructor(token) {
    this.token = token;
  }

  /** @param {string} method @param {string} name @param {any} [body] @param {Record<string, string>} [headers] */
  async #ask(method, name, body, headers = {}) {
    const answer = await fetch(new URL(`edit/${name}`, document.baseURI), {
      method,
      cache: "no-store",
      headers: { Authorization: `Bearer ${this.token}`, "Content-Type": "application/json", ...headers },
      body: body === undefined ? undefined : JSON.stringify(body),
    });
    const document_ = await answer.json().catch(() => ({}));
    if (!answer.ok) throw new Refusal(answer.status, document_);
    return document_;
  }

  /** @returns {Promise<Loaded>} */
  load() {
    return this.#ask("GET", "tour");
  }

  /** @param {any} tour @returns {Promise<{shown: Shown}>} */
  preview(tour) {
    return this.#ask("POST", "preview", tour);
  }

  /** @param {any} tour @param {string} tag of the version that it replaces @returns {Promise<{shown: Shown, tag: string}>} */
  save(tour, tag) {
    return this.#ask("PUT", "tour", tour, { "If-Match": tag });
  }

  /** @param {ArrayLike<number>} eye @param {number[]} direction @returns {Promise<{picks: Pick[]}>} */
  pick(eye, direction) {
    return this.#ask("POST", "pick", { eye: [...Array.from(eye)], direction });
  }
}
