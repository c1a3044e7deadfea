// What `pack` makes of shapes of random triangles: their triangles, batch by batch, and the boxes.

import { pack } from "../../web/page/gl/cell-buffers.js";

const [painted, counts] = JSON.parse(process.argv[2]);
let seed = 1;
const random = () => (seed = (seed * 16807) % 2147483647) / 2147483647;
const shapes = counts.map(([texture, vertices, triangles], n) => ({
  texture, clampU: false, clampV: false, factor: [1, 1, 1, 1], blends: false, cutoff: 0, twoSided: false,
  positions: Float32Array.from({ length: 3 * vertices }, () => Math.fround(random())),
  uvs: n % 2 ? null : Float32Array.from({ length: 2 * vertices }, () => Math.fround(random())),
  colors: painted && n % 2 ? new Uint16Array(4 * vertices).fill(65535 * (n % 3 === 0)) : null,
  indices: Uint32Array.from({ length: 3 * triangles }, () => Math.floor(random() * vertices)),
}));
const steps = pack(shapes);
let step = steps.next(), pauses = 0;
for (; !step.done; pauses++) step = steps.next();
const { data, index, batches, painted: found } = step.value, width = found ? 6 : 5;
const bytes = new Uint8Array(data.buffer);
const corner = (/** @type {number} */ v) => [...data.subarray(width * v, width * v + 5)].join()
  + (found ? `;${bytes.subarray(24 * v + 20, 24 * v + 24)}` : "");
const size = index.BYTES_PER_ELEMENT;
// Triangles by texture, as text, in any order of the textures.
const drawn = {}, given = {};
let outside = 0, most = 0;
for (const { look, first, count, low, high } of batches) {
  most = Math.max(most, count / 3);
  for (const v of index.subarray(first / size, first / size + count)) {
    (drawn[look.texture] ??= []).push(corner(v));
    const point = data.subarray(width * v, width * v + 3);
    outside += point.some((x, k) => x < low[k] || x > high[k]);
  }
}
for (const { texture, positions, uvs, colors, indices } of shapes) {
  for (const v of indices) {
    const uv = uvs ? [...uvs.subarray(2 * v, 2 * v + 2)] : [0, 0];
    const color = colors ? [...colors.subarray(4 * v, 4 * v + 4)].map((c) => c >> 8) : Array(4).fill(255);
    (given[texture] ??= []).push([...positions.subarray(3 * v, 3 * v + 3), ...uv].join()
      + (found ? `;${color}` : ""));
  }
}
console.log(JSON.stringify({
  same: JSON.stringify(drawn) === JSON.stringify(given),
  corners: Object.values(drawn).flat().length,
  batches: batches.length, most, outside, pauses, size, painted: found,
}));
