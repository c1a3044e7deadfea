// The document of a tour, as `ptm publish` writes it, and its texts in the visitor's language.

import { PageError } from "../net/errors.js";
import { tour as words } from "../words/english.js";

/**
 * @typedef {Record<string, string>} Texts by language; "" is for all
 * @typedef {string | [string, ...any[]]} Node of a text, see markup.js
 *
 * @typedef {object} Label
 * @property {string} id
 * @property {number[]} marker metres
 * @property {number[]} box least and greatest x, y, z of what it describes
 * @property {number} cell that the marker is in, or -1
 * @property {number[]} [normal] of a picture
 * @property {Texts} [title]
 * @property {Texts} [maker]
 * @property {Texts} [date]
 * @property {Texts} [image]
 * @property {Texts} [link]
 * @property {Record<string, Node[]>} [text]
 * @property {Texts} [sound] URLs relative to the document
 * @property {Texts} [captions]
 *
 * @typedef {object} Stop
 * @property {number[]} position
 * @property {number[]} direction
 * @property {number} [label]
 * @property {Texts} [title]
 *
 * @typedef {object} Document
 * @property {string[]} languages
 * @property {Texts} [title]
 * @property {Texts} [description]
 * @property {Record<string, Texts>} [places] names of viewpoints, by those of the model
 * @property {Label[]} labels
 * @property {Stop[]} stops
 */

/** @param {any} value @param {number} count */
const numbers = (value, count) =>
  Array.isArray(value) && value.length === count && value.every(Number.isFinite);

/**
 * Checks a document.
 * @param {any} tour
 * @returns {Document}
 */
export function checked(tour) {
  const right = Array.isArray(tour?.languages) && tour.languages.every((/** @type {any} */ tag) => typeof tag === "string")
    && Array.isArray(tour.labels) && Array.isArray(tour.stops)
    && tour.labels.every((/** @type {any} */ row) => typeof row?.id === "string"
      && numbers(row.marker, 3) && numbers(row.box, 6) && Number.isInteger(row.cell))
    && tour.stops.every((/** @type {any} */ row) => numbers(row?.position, 3) && numbers(row.direction, 3)
      && (row.label === undefined || row.label in tour.labels));
  if (!right) throw new PageError("PTM-V105", words.damaged);
  return tour;
}

/**
 * The language of the tour that suits the visitor best.
 * @param {string[]} offered
 * @param {readonly string[]} wanted the first is the best
 */
export function languageFor(offered, wanted) {
  const plain = (/** @type {string} */ tag) => tag.toLowerCase().split("-")[0];
  for (const tag of wanted) {
    const exact = offered.find((one) => one.toLowerCase() === tag.toLowerCase());
    const close = exact ?? offered.find((one) => plain(one) === plain(tag));
    if (close) return close;
  }
  return offered[0] ?? "en";
}

/**
 * The version of a text in a language, else that for all, else that of the first language, else any.
 * @template T
 * @param {Record<string, T> | undefined} texts
 * @param {string} language
 * @param {string} first
 * @returns {{text: T, tag: string} | null} its language, "" for all
 */
export function inLanguage(texts, language, first) {
  if (!texts || typeof texts !== "object") return null;
  const tag = [language, "", first, ...Object.keys(texts)].find((one) => Object.hasOwn(texts, one));
  return tag === undefined ? null : { text: texts[tag], tag };
}
