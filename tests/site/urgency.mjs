// In which order textures are decoded and shown, one at a time.

import { TextureMemory } from "../../web/page/gl/texture-memory.js";

const gl = new Proxy({}, { get: (_, name) => (name === "createTexture" ? () => ({}) : () => {}) });
const sizes = [1, 2, 4, 8].map((side) => ({ width: side, height: side }));
const rows = Array.from({ length: 6 }, () => ({ sizes, offsets: [0, 0, 0, 0], channels: 4 }));
/** @type {[number, number, (images: object) => void][]} */
const asked = [];
const decode = (texture, levels) => new Promise((come) => asked.push([texture, levels, come]));
const images = (levels) =>
  sizes.slice(0, levels).map(({ width, height }) => ({ width, height, data: new Uint8Array(0) }));
const memory = new TextureMemory(gl, rows, decode);
memory.fades = false;

const order = [];
async function settle(want, priority, loss) {
  memory.settle(Int32Array.from(want), Float64Array.from(priority), Float64Array.from(loss));
  while (asked.length) {
    const [texture, levels, come] = asked.shift();
    order.push([texture, levels]);
    come({ images: images(levels), loss: loss[texture] });
    await new Promise((done) => setImmediate(done));
    memory.pump(0, () => false);
  }
}
// The first two show previews.
await settle([2, 2, 0, 0, 0, 3], [0.3, 0.2, 0, 0, 0, 0.1], [1, 1, 0, 0, 0, 0]);
order.length = 0;
// Exact levels for the first, more for the second, none yet in the third to fifth, fewer for the sixth.
await settle([2, 4, 1, 2, 0, 1], [0.3, 0.2, 0.02, 0.05, 0.4, 0.03], [0, 0, 0, 0, 0, 0]);
console.log(JSON.stringify({ order, held: [...memory.held], loss: [...memory.loss] }));
