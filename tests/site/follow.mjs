// Follows a recorded walk through a real database: node follow.mjs WWW WALK.json
// prints how much of it was done, the eyes, how far they were from the walk, seen from above, the cells
// that were entered, milliseconds, and how many eyes of a wild walk from all viewpoints were astray.

import { readFileSync } from "node:fs";
import { readGlb } from "../../web/page/data/glb.js";
import { loadViewDecoder } from "../../web/ptm/src/meshopt.js";
import { Solids } from "../../web/page/walk/solids.js";
import { Walker } from "../../web/page/walk/walker.js";

const [www, walk] = process.argv.slice(2);
const json = (path) => JSON.parse(readFileSync(path, "utf8"));
const index = json(`${www}/hints.json`);
const solids = new Solids();
const begun = performance.now();
const wasm = new URL("../../web/ptm/src/decoder.wasm", import.meta.url);
const decoder = await loadViewDecoder(readFileSync(wasm));
const records = [];
for (const [cell, { name }] of index.cells.entries()) {
  const record = json(`${www}/hints/${name}.json`), glb = readFileSync(`${www}/gltf/${name}.glb`);
  const whole = glb.buffer.slice(glb.byteOffset, glb.byteOffset + glb.byteLength);
  solids.add(cell, (await readGlb(whole, Infinity, async () => decoder)).shapes, record);
  records.push(record);
}
const loading = performance.now() - begun;

const behind = (points, face, [x, y, z]) => {
  let a = 0, b = 0, c = 0, d = 0;
  face.forEach((_, k) => {
    const [p, q] = [0, 1].map((n) => points[face[(k + n) % face.length]]);
    a += (p[1] - q[1]) * (p[2] + q[2]);
    b += (p[2] - q[2]) * (p[0] + q[0]);
    c += (p[0] - q[0]) * (p[1] + q[1]);
  });
  const size = Math.hypot(a, b, c), [u, v, w] = points[face[0]];
  d = (a * (x - u) + b * (y - v) + c * (z - w)) / size;
  return d < 1e-3;
};
const holds = (eye) => ({ points, faces }) => faces.every((face) => behind(points, face, eye));
const locate = (eye) => records.findIndex(({ leaves }) => leaves.some(holds(eye)));

const samples = json(walk).samples.map(([, ...at]) => at.slice(0, 3));
const walker = new Walker({ solids, locate, avatar: index.avatarSize });
walker.place({ eye: samples[0], yaw: 0, pitch: 0 });
const eyes = [], offs = [], cells = new Set(), dts = [1 / 60, 1 / 144, 1 / 25, 1 / 10];
let slowest = 0, goal = 0;
const flat = ([x, , z], [u, , w]) => Math.hypot(x - u, z - w);
for (let k = 0; goal < samples.length - 1 && k < 60000; k++) {
  const { pose } = walker, { eye } = pose;
  while (goal < samples.length - 1 && flat(eye, samples[goal]) < 0.3) goal++;
  const [x, , z] = samples[goal];
  pose.yaw = Math.atan2(eye[0] - x, eye[2] - z);
  const start = performance.now();
  walker.step(dts[k % 4], { forward: 1, right: 0, turn: 0, look: 0, run: false });
  slowest = Math.max(slowest, performance.now() - start);
  eyes.push([...eye]);
  offs.push(Math.min(...samples.slice(Math.max(0, goal - 20), goal + 1).map((at) => flat(eye, at))));
  cells.add(locate(eye));
}
// Random walks: counts eyes outside all cells.
let seed = 1, astray = 0, wild = 0;
const random = () => (seed = (seed * 48271) % 2147483647) / 2147483647;
for (const { position } of index.viewpoints) {
  walker.place({ eye: position, yaw: 7 * random(), pitch: 0 });
  for (let k = 0; k < 40; k++) {
    const [forward, right, turn] = [0, 1, 2].map(() => Math.sign(random() - 0.3) * random());
    for (let n = 0; n < 10; n++) {
      walker.step(dts[k % 4], { forward, right, turn, look: 0, run: k % 3 === 0 });
      if (locate(walker.pose.eye) < 0) astray++;
      wild++;
    }
  }
}
const done = goal / (samples.length - 1), off = Math.max(...offs);
console.log(JSON.stringify({ done, off, cells: [...cells], eyes, loading, slowest, astray, wild }));
