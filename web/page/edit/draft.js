// The document of a tour while it is edited, with all that the form does not show; and the way back.

/** The order of the fields of a label and of a stop in new texts. */
const ORDER = [
  "id", "label", "object", "room", "at", "title", "description", "maker", "date", "text", "image", "sound", "captions", "link", "view",
];
/** Fields that are the same in all languages unless the tour has them in several. */
const COMMON = new Set(["maker", "date", "sound", "captions", "link"]);
/** The most steps back. */
const STEPS = 200;

/** @typedef {Record<string, any>} Row a label, a stop, or the tour itself, whose title is a text, too */

export class Draft {
  /** @type {{name: string, key: string, text: string}[]} */
  #steps = [];
  #saved = "";

  /** @param {any} document @param {string} tag of its file */
  constructor(document, tag) {
    this.document = document;
    this.document.stops ??= [];
    this.tag = tag;
    this.keep(tag);
  }

  /** @returns {Row[]} */
  get labels() {
    return this.document.labels;
  }

  /** @returns {Row[]} */
  get stops() {
    return this.document.stops;
  }

  /** @returns {string[]} */
  get languages() {
    return this.document.languages;
  }

  /** Whether something is not saved. */
  get changed() {
    return JSON.stringify(this.document) !== this.#saved;
  }

  /** The name of the last step, "" without one. */
  get last() {
    return this.#steps.at(-1)?.name ?? "";
  }

  /** The document is that of the file. @param {string} tag @param {string} [text] as it was sent */
  keep(tag, text = JSON.stringify(this.document)) {
    this.tag = tag;
    this.#saved = text;
  }

  /**
   * A step that can be undone; steps in a row with the same key are one.
   * @param {string} name @param {() => void} change @param {string} [key]
   */
  step(name, change, key = "") {
    const text = JSON.stringify(this.document), last = this.#steps.at(-1);
    change();
    if ((key && last?.key === key) || text === JSON.stringify(this.document)) return;
    this.#steps = [...this.#steps.slice(1 - STEPS), { name, key, text }];
  }

  /** The next step is one of its own, though it has the key of the last. */
  pause() {
    const last = this.#steps.at(-1);
    if (last) last.key = "";
  }

  undo() {
    const step = this.#steps.pop();
    if (step) this.document = JSON.parse(step.text);
  }

  /** Another version of the file; the present one is a step back. @param {any} document @param {string} tag */
  replace(document, tag) {
    this.step("load the file", () => (this.document = { ...document, stops: document.stops ?? [] }));
    this.keep(tag);
  }

  /** An id that no label has. @param {string} name */
  idFor(name) {
    const stem = name.normalize("NFKD").toLowerCase().replace(/[^a-z0-9_-]+/g, "-").replace(/^[-_]+/, "").slice(0, 56)
      .replace(/-+$/, "") || "label";
    const taken = new Set(this.labels.map(({ id }) => id));
    let id = stem;
    for (let number = 2; taken.has(id); number++) id = `${stem}-${number}`;
    return id;
  }

  /** The stop at which a label opens, or -1. @param {string} id */
  stopOf(id) {
    return this.stops.findIndex(({ label }) => label === id);
  }

  /** Removes a label with its stops. @param {number} number */
  removeLabel(number) {
    const [{ id }] = this.labels.splice(number, 1);
    this.document.stops = this.stops.filter(({ label }) => label !== id);
  }

  /** Changes the id of a label, also in stops. @param {number} number @param {string} id */
  rename(number, id) {
    const before = this.labels[number].id;
    this.labels[number].id = id;
    for (const stop of this.stops) if (stop.label === before) stop.label = id;
  }

  /** Removes a language with its texts. @param {string} tag */
  removeLanguage(tag) {
    this.document.languages = this.languages.filter((one) => one !== tag);
    const { places = {} } = this.document;
    for (const row of [this.document, places, ...this.labels, ...this.stops]) {
      for (const name of row === places ? Object.keys(places) : ORDER) {
        const texts = row[name];
        if (!isTexts(texts)) continue;
        delete texts[tag];
        if (!Object.keys(texts).length) delete row[name];
      }
    }
  }
}

/** @param {any} value */
const isTexts = (value) => typeof value === "object" && value !== null && !Array.isArray(value);

/** Whether a field has one text for all languages. @param {Row} row @param {string} name */
export const isCommon = (row, name) =>
  typeof row[name] === "string" || (row[name] === undefined && COMMON.has(name));

/** The text of a field in a language, "" without one. @param {Row} row @param {string} name @param {string} tag */
export function textIn(row, name, tag) {
  const value = row[name];
  return String((isTexts(value) ? (Object.hasOwn(value, tag) ? value[tag] : "") : value) ?? "");
}

/** Changes it. @param {Row} row @param {string} name @param {string} tag @param {string} text */
export function putText(row, name, tag, text) {
  if (isCommon(row, name)) return put(row, name, text || undefined);
  const texts = { ...row[name], [tag]: text };
  if (!text) delete texts[tag];
  put(row, name, Object.keys(texts).length ? texts : undefined);
}

/**
 * Makes one text for all languages of those of a field, or the other way round.
 * @param {Row} row @param {string} name @param {boolean} common @param {string} tag of the text @param {string} first language
 */
export function putCommon(row, name, common, tag, first) {
  const text = textIn(row, name, tag) || textIn(row, name, first);
  // An empty object is a field with a text for each language that has none yet.
  put(row, name, common ? text : text ? { [first]: text } : {});
}

/** Sets a field, in its place among the others; removes it without a value. @param {Row} row @param {string} name @param {any} value */
export function put(row, name, value) {
  if (value === undefined) delete row[name];
  else if (name in row) row[name] = value;
  else {
    const rest = Object.entries(row), rank = ORDER.indexOf(name);
    const place = rest.findIndex(([other]) => ORDER.indexOf(other) > rank);
    rest.splice(place < 0 ? rest.length : place, 0, [name, value]);
    for (const key of Object.keys(row)) delete row[key];
    Object.assign(row, Object.fromEntries(rest));
  }
}
