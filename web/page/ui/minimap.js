// The map: the cells of the storey, those visible from here, and the visitor.

import { footprintOf } from "../space/footprint.js";
import { make } from "./elements.js";
import { panels } from "../words/english.js";
import { fill } from "../words/language.js";

/** @typedef {import("./all.js").App} App */

/** Floors that differ by less are of one storey, m, which has at least such a share of the area of the
 * largest, unlike a landing; pixels around the plan; ms between pictures. */
const STOREY = 1.8, SHARE = 0.2, RIM = 10, OFTEN = 100;
const HERE = "#ffc766", SEEN = "#7fa8d8", REST = "#ffffff24", WALLS = "#f4f1ea8c";

/** @param {HTMLElement} root the panel @param {App} app */
export function attachMinimap(root, app) {
  const plan = make("canvas", { role: "img" });
  const storey = make("span"), place = make("p", { className: "place", dir: "auto" }), key = make("p", { className: "key" });
  for (const [name, color] of [[panels.here, HERE], [panels.visible, SEEN]]) {
    key.append(make("span", { style: `--color:${color}` }, name), " ");
  }
  root.append(make("h2", {}, panels.map, storey), plan, place, key);
  const paint = plan.getContext("2d");
  let timer = 0, last = "";

  const draw = () => {
    const { cells, here, visible } = app.plan(), { eye, yaw } = app.walker.pose;
    const width = plan.clientWidth, seen = new Set(visible);
    const now = [here, visible.length, width, ...[yaw, ...eye].map((v) => v.toFixed(2))].join();
    if (!width || now === last || !cells.length) return;
    last = now;

    const storeys = storeysOf(cells);
    const number = Math.max(1, storeys.filter((floor) => floor < eye[1]).length);
    storey.textContent = storeys.length > 1 ? fill(panels.storey, { number, count: storeys.length }) : "";
    const title = app.index.viewpoints.find(({ cell }) => cell === here)?.title;
    place.lang = title?.tag ?? "";
    place.textContent = title?.text ?? "";
    plan.ariaLabel = [fill(panels.plan, { number, cell: here }), ...(title ? [title.text] : [])].join(": ");

    const [left, top] = [0, 2].map((k) => Math.min(...cells.map(({ low }) => low[k])));
    const [right, bottom] = [0, 2].map((k) => Math.max(...cells.map(({ high }) => high[k])));
    const scale = Math.min((width - 2 * RIM) / (right - left), width / (bottom - top));
    const height = scale * (bottom - top) + 2 * RIM, sharp = devicePixelRatio;
    plan.style.height = `${height}px`;
    plan.width = width * sharp;
    plan.height = height * sharp;
    paint.scale(sharp, sharp);
    paint.translate(width / 2 - (scale * (left + right)) / 2, RIM - scale * top);
    paint.scale(scale, scale);
    paint.lineWidth = 1 / scale;
    paint.strokeStyle = WALLS;
    for (const { cell, low, high, leaves } of cells) {
      if (eye[1] < low[1] || eye[1] > high[1]) continue;
      const [x, , z] = low, [u, , w] = high;
      const outline = leaves && footprintOf(leaves.flatMap(({ points }) => points));
      paint.beginPath();
      for (const [a, b] of outline ?? [[x, z], [u, z], [u, w], [x, w]]) paint.lineTo(a, b);
      paint.closePath();
      paint.fillStyle = cell === here ? `${HERE}99` : seen.has(cell) ? `${SEEN}80` : REST;
      paint.fill();
      paint.stroke();
    }
    paint.translate(eye[0], eye[2]);
    paint.scale(1 / scale, 1 / scale);
    paint.rotate(-yaw);
    paint.beginPath();
    for (const [a, b] of [[0, -10], [7, 8], [0, 4], [-7, 8]]) paint.lineTo(a, b);
    paint.closePath();
    paint.fillStyle = "#fff";
    paint.strokeStyle = "#000";
    paint.lineWidth = 3;
    paint.stroke();
    paint.fill();
  };
  root.addEventListener("rename", () => (last = ""));
  root.addEventListener("open", () => {
    last = "";
    timer = setInterval(draw, OFTEN);
    draw();
  });
  root.addEventListener("close", () => clearInterval(timer));
}

/** The lowest floor of each storey. @param {{low: number[], high: number[]}[]} cells */
function storeysOf(cells) {
  /** @type {{lowest: number, area: number}[]} */
  const storeys = [];
  for (const { low, high } of [...cells].sort((a, b) => a.low[1] - b.low[1])) {
    const last = storeys[storeys.length - 1], floor = low[1];
    const area = (high[0] - low[0]) * (high[2] - low[2]);
    if (last && floor - last.lowest <= STOREY) last.area += area;
    else storeys.push({ lowest: floor, area });
  }
  const least = SHARE * Math.max(...storeys.map(({ area }) => area));
  return storeys.filter(({ area }) => area >= least).map(({ lowest }) => lowest);
}
