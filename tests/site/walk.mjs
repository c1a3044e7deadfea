// Walks through small worlds: node walk.mjs CASES.json prints for each case the eyes after each step.
//
// A case: {cells: [{cell, box, quads: [[4 corners], …], portals, missing}], avatar, eye, yaw, steps:
// [[times, dt, wishes], …]}. A cell that is missing is known, but its geometry is not there.

import { readFileSync } from "node:fs";
import { Walker } from "../../web/page/walk/walker.js";
import { worldOf } from "./world.mjs";

const cases = JSON.parse(readFileSync(process.argv[2], "utf8"));
console.log(JSON.stringify(cases.map(({ cells, avatar, eye, yaw, steps }) => {
  const walker = new Walker({ ...worldOf(cells), avatar });
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
