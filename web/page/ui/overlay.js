// The details panel: numbers of the walk, several times a second, and the settings.

import { inBytes, inMemory, make } from "./elements.js";
import { attachSettings } from "./settings.js";

/** @typedef {import("./all.js").State} State */

/** ms */
const OFTEN = 250;

/** @type {[string, (state: State) => string][]} */
const ROWS = [
  ["Frame rate", ({ fps }) => `${fps.toFixed(0)} fps`],
  ["With 3 bytes for RGB", ({ paperBytes }) => inMemory(paperBytes)],
  ["Received", ({ bytes, requests }) => `${inBytes(bytes)}, ${requests} requests`],
  ["Connection", ({ bandwidth, latency }) =>
    `${(bandwidth / 1e6).toFixed(2)} Mbit/s, ${(1000 * latency).toFixed(0)} ms`],
  ["Cell", ({ cell, drawnCells }) => `${cell < 0 ? "none" : cell} (${drawnCells.length} drawn)`],
  ["Pending", ({ pending, complete }) => (complete ? "nothing for this view" : `${pending} requests`)],
];

/** @param {HTMLElement} root the panel @param {import("./all.js").App} app */
export function attachOverlay(root, app) {
  const memory = make("p", { id: "memory" });
  const fill = make("progress", { "aria-labelledby": "memory" });
  const values = ROWS.map(() => make("dd"));
  const bars = make("p", { className: "bars", role: "img" });
  root.append(
    make("h2", {}, "Details"), memory, fill,
    make("dl", {}, ...ROWS.flatMap(([name], k) => [make("dt", {}, name), values[k]])),
    make("h3", {}, "Textures by finest level loaded"), bars,
  );
  attachSettings(root, app);

  let timer = 0;
  const show = () => {
    const state = app.state(), { residentBytes, budgetBytes, levels } = state;
    const how = app.measured?.bytes === budgetBytes ? ", measured" : "";
    memory.textContent = `Texture memory: ${inMemory(residentBytes)} of ${inMemory(budgetBytes)}${how}`;
    fill.max = budgetBytes;
    fill.value = residentBytes;
    ROWS.forEach(([, textOf], k) => {
      const text = textOf(state);
      if (values[k].textContent !== text) values[k].textContent = text;
    });
    const most = Math.max(1, ...levels);
    while (bars.children.length < levels.length) bars.append(make("span"));
    levels.forEach((count, k) => {
      bars.children[k].style = `--share:${count / most}`;
      bars.children[k].textContent = k ? k - 1 : "–";
    });
    bars.ariaLabel = levels
      .flatMap((count, k) => (count ? [`${count} ${k ? `to level ${k - 1}` : "with none"}`] : []))
      .join(", ");
  };
  root.addEventListener("open", () => {
    timer = setInterval(show, OFTEN);
    show();
  });
  root.addEventListener("close", () => clearInterval(timer));
}
