// Triangles of a cell added bit by bit and at once: node slices.mjs COUNT prints how often it took, how
// many were there before the end, and what is near some boxes in either.

import { Solids } from "../../web/page/walk/solids.js";

const count = Number(process.argv[2]);
let seed = 1;
const random = () => (seed = (seed * 16807) % 2147483647) / 2147483647;
const positions = new Float32Array(9 * count).map(() => 20 * random());
const indices = new Uint32Array(3 * count).map((_, k) => k);
const world = [[{ positions, indices }], { portals: [] }];
const boxes = Array.from({ length: 20 }, () => {
  const low = [random(), random(), random()].map((x) => 18 * x);
  return [low, low.map((x) => x + 2)];
});

const near = (solids) =>
  boxes.map(([low, high]) => {
    const found = [];
    solids.near(low, high, (corners, at, kind) => found.push([...corners.slice(at, at + 9), kind]));
    return found;
  });

const whole = new Solids(), parts = new Solids();
whole.add(0, ...world);
let calls = 1, early = 0;
for (; !parts.add(0, ...world, () => true); calls++) {
  early += near(parts).flat().length + parts.has(0);
}
console.log(JSON.stringify({ calls, early, whole: near(whole), parts: near(parts) }));
