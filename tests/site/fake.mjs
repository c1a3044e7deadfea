// The interface without a museum: an app that stands for main.js, and paints a horizon.

import { Solids } from "/page/walk/solids.js";
import { Walker } from "/page/walk/walker.js";
import { attachUi } from "/page/ui/all.js";
import { poseOf } from "/page/ui/address.js";

const HALL = [[-6, -6, 0, 6, 6], [6, -3, 0, 12, 3], [-6, -14, 0, 2, -6], [-6, -6, 4, 6, 6],
  [6, -3, 4, 12, 3], [2, -14, 0, 12, -6]];
const cells = HALL.map(([x, z, y, u, w], cell) => ({ cell, low: [x, y, z], high: [u, y + 3.5, w] }));
const viewpoints = ["Hall", "Cabinet", "Gallery", "Upper hall", "Upper cabinet"].map((description, k) => ({
  name: `VP_${k}`, description, thumbnail: k < 3 ? "vp.png" : undefined,
}));
const poses = [[0, 1.6, 4], [9, 1.6, 0], [-2, 1.6, -8], [0, 5.6, 4], [9, 5.6, 0]].map((eye) => ({
  eye, yaw: 0.4, pitch: 0,
}));

const solids = new Solids();
cells.forEach(({ cell, low, high }) => {
  const [x, y, z] = low, [u, , w] = high;
  solids.add(cell, [{
    positions: new Float32Array([x, y, z, x, y, w, u, y, w, u, y, z]),
    indices: new Uint16Array([0, 1, 2, 0, 2, 3]),
  }], { portals: [] });
});
const locate = (eye) => cells.findIndex(({ low, high }) =>
  eye.every((value, k) => value >= low[k] && value <= high[k]));
const walker = new Walker({ solids, locate, avatar: [0.25, 1.6, 0.5] });
walker.place(poseOf(location.hash) ?? poses[0]);

const listeners = {}, calls = [];
// As methods are, which are lost without their object.
const called = (name) => function (...what) {
  if (this !== app) throw new TypeError(`${name} of nothing`);
  calls.push([name, ...what]);
};
const canvas = document.querySelector("#view");
let budget = 64 * 2 ** 20, policy = "best", frames = 0;
const app = {
  index: { viewpoints },
  config: JSON.parse(document.querySelector("#site").textContent),
  walker,
  canvas,
  follow(place) {
    this.goTo(place);
  },
  goTo(place) {
    calls.push(["goTo", place]);
    walker.place(typeof place === "number" ? poses[place] : place);
  },
  on: (name, tell) => (listeners[name] ??= []).push(tell),
  setBudget(bytes) { called("setBudget").call(this, (budget = bytes)); },
  setPolicy(name) { called("setPolicy").call(this, (policy = name)); },
  setPatience: called("setPatience"),
  setDataSaver: called("setDataSaver"),
  freeze: called("freeze"),
  compare: called("compare"),
  plan: () => ({ cells, here: Math.max(0, locate(walker.pose.eye)), visible: [0, 1, 2] }),
  state: () => ({
    cell: locate(walker.pose.eye), drawnCells: [0, 1, 2], residentBytes: 0.7 * budget,
    budgetBytes: budget, paperBytes: 0.5 * budget, requests: 41 + Math.floor(frames / 60),
    bytes: 1.7e6 + 900 * frames, pending: 2, complete: false, fps: 59.6, bandwidth: 3.4e6,
    latency: 0.084, bufferAge: 0.11, policy, levels: [0, 1, 0, 2, 5, 9, 7, 3, 1, 0, 0],
  }),
};
const emit = (name, event) => listeners[name]?.forEach((tell) => tell(event));
const ui = attachUi(app);
const paint = canvas.getContext("2d");
let last = performance.now();
const report = [];
function frame(now) {
  const wishes = ui.wishes();
  report.push(wishes);
  walker.step((now - last) / 1000, wishes);
  last = now;
  frames++;
  const { clientWidth: w, clientHeight: h } = canvas, { yaw, pitch, eye } = walker.pose;
  canvas.width = w;
  canvas.height = h;
  const level = h / 2 + (pitch * h * 3) / Math.PI;
  paint.fillStyle = "#d8cfc0";
  paint.fillRect(0, 0, w, level);
  paint.fillStyle = "#7a5a3c";
  paint.fillRect(0, level, w, h);
  for (let k = 0; k < 24; k++) {
    const x = (((k / 24 + yaw / 6.2832) % 1) + 1) % 1;
    paint.fillStyle = `hsl(${k * 15} 40% 45%)`;
    paint.fillRect((x * 6 - 2.5) * w, level - h / 4, w / 9, h / 3 + eye[2] * 4);
  }
  requestAnimationFrame(frame);
}
requestAnimationFrame(frame);
window.fake = { app, emit, calls, report, walker };
