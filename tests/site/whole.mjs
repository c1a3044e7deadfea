// Texture memory of the policy `whole` on a GPU that holds nothing: textures are drawn in a given order.
// Prints what each drawing uploads and frees, and the most bytes.

import { WholeMemory } from "../../web/page/gl/whole-memory.js";

const { sides, draws, budget } = JSON.parse(process.argv[2]);
let uploaded = 0, freed = [];
const gl = new Proxy({}, {
  get: (_, name) => ({
    createTexture: () => ({}),
    texSubImage2D: (...given) => (uploaded += given[8].byteLength),
    deleteTexture: (texture) => freed.push(owners.get(texture)),
  })[name] ?? (() => {}),
});
const owners = new Map();
const levels = sides.map((side) => {
  const sizes = [];
  for (let size = 1; size <= side; size *= 2) sizes.push({ width: size, height: size });
  return sizes;
});
const rows = levels.map((sizes) => ({ sizes, offsets: sizes.map(() => 0), channels: 4 }));
const here = new Set();
const decode = async (t, count) => {
  if (!here.has(t)) throw new Error("not here");
  const images = levels[t].slice(0, count)
    .map(({ width, height }) => ({ width, height, data: new Uint8Array(4 * width * height) }));
  return { images, loss: 0 };
};
const memory = new WholeMemory(gl, rows, decode);
memory.budget = budget;
const none = new Int32Array(sides.length), zeros = new Float64Array(sides.length);
const settle = async () => {
  memory.settle(none, zeros, zeros);
  await new Promise((done) => setImmediate(done));
  return memory.pump();
};

const all = [...sides.keys()];
const early = all.map((t) => memory.of(t));
const lacked = await settle();
for (const t of all) here.add(t);
const came = await settle();
const report = [];
for (const t of draws) {
  uploaded = 0;
  freed = [];
  const storage = memory.of(t);
  if (storage) owners.set(storage.texture, t);
  report.push([storage !== null, uploaded, [...freed]]);
}
const { peak, bytes } = memory;
memory.budget = 0;
memory.settle(none, zeros, zeros);
console.log(JSON.stringify({
  early, lacked, came, held: [...memory.held], report, peak, bytes, left: memory.bytes,
}));
