// The details panel: numbers of the walk, several times a second, and the settings.

import { inBytes, inMemory, make } from "./elements.js";
import { attachSettings } from "./settings.js";
import { panels } from "../words/english.js";
import { fill } from "../words/language.js";

/** @typedef {import("./all.js").State} State */

/** ms */
const OFTEN = 250;

/** @type {[string, (state: State) => string][]} */
const ROWS = [
  [panels.frames, ({ fps }) => fill(panels.frameRate, { number: fps.toFixed(0) })],
  [panels.paper, ({ paperBytes }) => inMemory(paperBytes)],
  [panels.received, ({ bytes, requests }) => `${inBytes(bytes)}, ${fill(panels.requests, { count: requests })}`],
  [panels.connection, ({ bandwidth, latency }) =>
    `${(bandwidth / 1e6).toFixed(2)} Mbit/s, ${(1000 * latency).toFixed(0)} ms`],
  [panels.cell, ({ cell, drawnCells }) =>
    fill(panels.drawn, { cell: cell < 0 ? panels.none : cell, count: drawnCells.length })],
  [panels.pending, ({ pending, complete }) => (complete ? panels.nothing : fill(panels.requests, { count: pending }))],
];

/** @param {HTMLElement} root the panel @param {import("./all.js").App} app */
export function attachOverlay(root, app) {
  const memory = make("p", { id: "memory" });
  const gauge = make("progress", { "aria-labelledby": "memory" });
  const values = ROWS.map(() => make("dd"));
  const bars = make("p", { className: "bars", role: "img" });
  root.append(
    make("h2", {}, panels.details), memory, gauge,
    make("dl", {}, ...ROWS.flatMap(([name], k) => [make("dt", {}, name), values[k]])),
    make("h3", {}, panels.levels), bars,
  );
  attachSettings(root, app);

  let timer = 0;
  const show = () => {
    const state = app.state(), { residentBytes, budgetBytes, levels } = state;
    const text = app.measured?.bytes === budgetBytes ? panels.measured : panels.used;
    memory.textContent = fill(text, { bytes: inMemory(residentBytes), most: inMemory(budgetBytes) });
    gauge.max = budgetBytes;
    gauge.value = residentBytes;
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
      .flatMap((count, k) => (count ? [fill(k ? panels.toLevel : panels.withNone, { count, level: k - 1 })] : []))
      .join(", ");
  };
  root.addEventListener("open", () => {
    timer = setInterval(show, OFTEN);
    show();
  });
  root.addEventListener("close", () => clearInterval(timer));
}
