// The link to a place in a field, for browsers that do not let the page copy it.

import { panels } from "../words/english.js";
import { make } from "./elements.js";
import { showNotice } from "./errors.js";

/** @param {Document} root @param {string} link */
export function showLink(root, link) {
  const field = make("input", { value: link, readOnly: true, ariaLabel: panels.link });
  showNotice(root, panels.copy, field);
  field.select();
}
