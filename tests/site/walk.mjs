// Walks through small worlds: node walk.mjs CASES.json prints for each case the eyes after each step.
//
// A case: {cells: [{cell, box, quads: [[4 corners], …], portals, missing}], avatar, eye, yaw, steps:
// [[times, dt, wishes], …]}. A cell that is missing is known, but its geometry is not there.

import { readFileSync } from "node:fs";
import { Solids } from "../../web/page/walk/solids.js";
import { Walker } from "../../web/page/walk/walker.js";

const shapeOf = (quads) => ({
  positions: new Float32Array(quads.flat(2)),
  indices: new Uint32Array(quads.flatMap((_, k) => [0, 1, 2, 0, 2, 3].map((n) => 4 * k + n))),
});

const cases = JSON.parse(readFileSync(process.argv[2], "utf8"));
console.log(JSON.stringify(cases.map(({ cells, avatar, eye, yaw, steps }) => {
  const solids = new Solids();
  for (const { cell, quads, portals, missing } of cells) {
    if (!missing) solids.add(cell, [shapeOf(quads)], { portals });
  }
  const holds = ([x, y, z], [a, b, c, d, e, f]) =>
    x >= a && x <= d && y >= b && y <= e && z >= c && z <= f;
  const locate = (at) => cells.find(({ box }) => holds(at, box))?.cell ?? -1;
  const walker = new Walker({ solids, locate, avatar });
  walker.place({ eye, yaw, pitch: 0 });
  const none = { forward: 0, right: 0, turn: 0, look: 0, run: false };
  const path = [];
  for (const [times, dt, wishes] of steps) {
    for (let k = 0; k < times; k++) {
      walker.step(dt, { ...none, ...wishes });
      path.push([...walker.pose.eye]);
    }
  }
  return path;
})));
