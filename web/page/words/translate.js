// Translates the page as it was sent, and keeps the words for scripts that are loaded later. The script of a
// language consists of this and of its words.

import { markup } from "./english.js";

/**
 * @param {string} language
 * @param {any} words of ptmtools/site/words
 */
export function translate(language, words) {
  Reflect.set(globalThis, "ptmWords", words);
  document.documentElement.lang = language;
  document.documentElement.dir = words.direction;
  /** @type {Map<string, string>} */
  const table = new Map();
  for (const [name, text] of Object.entries(markup)) table.set(text, words.markup[name]);
  // The title of the building is not a word of the page.
  const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT, ({ parentElement }) =>
    parentElement?.closest("h1, script") ? NodeFilter.FILTER_REJECT : NodeFilter.FILTER_ACCEPT);
  for (let node = texts.nextNode(); node; node = texts.nextNode()) {
    const text = node.nodeValue?.trim() ?? "";
    if (table.has(text)) node.nodeValue = table.get(text) ?? "";
  }
  for (const element of document.querySelectorAll("[aria-label]")) {
    const name = element.ariaLabel ?? "";
    if (element.tagName === "CANVAS") {
      element.ariaLabel = name.replace(markup.arrows, () => words.markup.arrows);
    } else if (table.has(name)) element.ariaLabel = table.get(name) ?? "";
  }
}
