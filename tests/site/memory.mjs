// Texture memory on a GPU that holds nothing, through changes of the budget and of what is wanted:
// for each stage, what was wanted, what was held in the end, and the most bytes meanwhile.

import { TextureMemory } from "../../web/page/gl/texture-memory.js";

const [side, count] = process.argv.slice(2).map(Number);
const gl = new Proxy({}, { get: (_, name) => (name === "createTexture" ? () => ({}) : () => {}) });
const sizes = [];
for (let size = 1; size <= side; size *= 2) sizes.push({ width: size, height: size });
const offsets = sizes.map(() => 0);
const rows = Array.from({ length: count }, () => ({ sizes, offsets, channels: 4 }));
const decode = async (_, levels) => ({
  images: sizes.slice(0, levels).map(({ width, height }) => ({ width, height, data: new Uint8Array(0) })),
  loss: 0,
});
const memory = new TextureMemory(gl, rows, decode);
memory.fades = false;

const all = sizes.length, priority = Float64Array.from(rows, (_, t) => 1 / count + 1e-6 * t);
const bytes = sizes.reduce((sum, { width }) => sum + 4 * width * width, 0);
const least = sizes.slice(0, -1).reduce((sum, { width }) => sum + 4 * width * width, 0);
// All whole; then room for half of them, to the brim; then the other half of them.
const half = Math.floor(count / 2) * bytes + 8;
const whole = Math.max(0, Math.floor((half - (count + 1) * least) / (bytes - least)));
const stages = [
  { budget: 2 * count * bytes, want: () => all },
  { budget: half, want: (t) => (t < whole ? all : all - 1) },
  { budget: half, want: (t) => (t >= count - whole ? all : all - 1) },
  { budget: half, want: (t) => (t < whole ? all : t % 2 ? all - 2 : 0) },
];
const report = [];
for (const { budget, want } of stages) {
  memory.budget = budget;
  memory.peak = 0;
  const wanted = Int32Array.from(rows, (_, t) => want(t));
  for (let look = 0; look < 40; look++) {
    memory.settle(wanted, priority, new Float64Array(count));
    for (let frame = 0; frame < 10; frame++) {
      await new Promise((done) => setImmediate(done));
      memory.pump(look, () => false);
    }
  }
  report.push({ wanted: [...wanted], held: [...memory.held], peak: memory.peak, budget });
}
console.log(JSON.stringify(report));
