// Shows errors, with their remedies, and notices.

import { find, make } from "./elements.js";
import { page } from "../words/english.js";

/** Duration of a notice, ms. */
const STAYS = 8000;

/** Parts of the page that an error disables. */
const BEHIND = ["nav", "#panels", "#view"];

/** Shows an error over the page. @param {Document} root
 * @param {{code: string, message: string}} error */
export function showError(root, { code, message }) {
  const panel = find(root, "#error"), again = find(root, "#again");
  find(root, "#error-text").textContent = message;
  find(root, "#error-remedy").textContent = /** @type {Record<string, string>} */ (page)[code] ?? page.otherwise;
  find(root, "#error-code").textContent = code;
  find(root, "#loading").hidden = true;
  panel.hidden = false;
  for (const name of BEHIND) find(root, name).inert = true;
  again.onclick = () => location.reload();
  again.focus();
}

/** Hides the error: the walk has begun after all. @param {Document} root */
function hideError(root) {
  const panel = find(root, "#error");
  if (panel.hidden) return;
  panel.hidden = true;
  for (const name of BEHIND) find(root, name).inert = false;
  find(root, "#view").focus();
}

/** Shows a notice for a while. @param {Document} root @param {...(string | Node)} message */
export function showNotice(root, ...message) {
  const line = make("p", {}, ...message);
  find(root, "#notices").append(line);
  // A notice that has the focus stays.
  const leave = () => {
    if (line.contains(root.activeElement)) setTimeout(leave, STAYS);
    else line.remove();
  };
  setTimeout(leave, STAYS);
}

/** Each notice is given once. @param {Document} root @param {import("./all.js").App} app */
export function attachErrors(root, app) {
  /** @type {Set<string>} */
  const shown = new Set();
  app.on("error", (error) => showError(root, error));
  app.on("first-picture", () => hideError(root));
  app.on("notice", ({ message }) => {
    if (shown.has(message)) return;
    shown.add(message);
    showNotice(root, message);
  });
}
