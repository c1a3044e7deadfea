// The visitor's language. English is in the scripts; another language is a script of its own, which takes
// the place of the English words before something is shown.

import { page } from "./english.js";

/** Languages besides English, which have a file in ptmtools/site/words. */
const OTHERS = "de fr es it zh ja";

/** Ends when the words are there: what is said before would be in English. @type {Promise<void>} */
export let spoken = Promise.resolve();

/**
 * Loads the words of the visitor's language: that of `?lang=`, or the first of the browser's that exists.
 * Without its script the page stays in English.
 * @param {Record<string, Record<string, string>>} [sections] of english.js that this script has
 */
export const speak = (sections = { page }) => (spoken = learn(sections));

/** @param {Record<string, Record<string, string>>} sections */
async function learn(sections) {
  const asked = [new URLSearchParams(location.search).get("lang") ?? "", ...navigator.languages];
  const language = asked.map((tag) => tag.toLowerCase().split("-")[0])
    .find((tag) => `en ${OTHERS}`.split(" ").includes(tag)) ?? "en";
  if (language === "en") return;
  // A name in a variable: the build must not look for the file.
  const name = `./words-${language}.js`, script = await import(name).catch(() => null);
  for (const section in sections) Object.assign(sections[section], script?.words[section]);
}

/** A text with values in the place of `{name}`. @param {string} text
 * @param {Record<string, string | number>} values */
export const fill = (text, values) => text.replace(/\{(\w+)\}/g, (_, name) => /** @type {string} */ (values[name]));
