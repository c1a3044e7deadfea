// The help panel: keys and gestures.

import { panels } from "../words/english.js";
import { make } from "./elements.js";

/** Keys with slashes between those that do the same; keys that do opposite things stand side by side. */
const ROWS = /** @type {const} */ ([
  ["W S/↑ ↓", "forward"], ["A D/← →", "turn"], ["Q E/Shift ← →", "sideways"],
  ["PageUp PageDown", "look"], ["Shift", "run"], ["mouse", "drag"], ["oneFinger", "dragWalk"],
  ["twoFingers", "drag"], ["gamepad", "pad"], ["`", "details"], ["Esc", "close"],
]);

/** Names of keys as they are written on keyboards. @type {Record<string, string>} */
const NAMES = { PageUp: "Page Up", PageDown: "Page Down" };

/** @param {HTMLElement} root the panel @param {import("./all.js").App} app */
export function attachHelp(root, app) {
  const words = /** @type {Record<string, string>} */ (panels);
  const rows = ROWS.flatMap(([keys, effect]) => [
    make("dt", {}, ...(keys in panels ? [words[keys]] : keysOf(keys))),
    make("dd", {}, words[effect]),
  ]);
  root.append(make("h2", {}, panels.howTo), make("dl", { id: "keys" }, ...rows));
  app.canvas.setAttribute("aria-describedby", "keys");
}

/** @param {string} keys */
const keysOf = (keys) =>
  keys.split("/").flatMap((same, k) => [
    k ? " / " : "",
    ...same.split(" ").flatMap((key) => [make("kbd", {}, NAMES[key] ?? key), " "]),
  ]);
