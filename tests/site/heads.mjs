// Visitors with headsets in small worlds: node heads.mjs CASES.json prints for each case the heads in the
// building after each picture.
//
// A case is that of walk.mjs, with `heads` in place of steps: [x, y, z, yaw, push] in the room, the push of the stick.

import { readFileSync } from "node:fs";
import { Walker } from "../../web/page/walk/walker.js";
import { Body } from "../../web/page/xr/body.js";
import { worldOf } from "./world.mjs";

const matrix = (x, y, z, yaw) => {
  const s = Math.sin(yaw), c = Math.cos(yaw);
  return [c, 0, -s, 0, 0, 1, 0, 0, s, 0, c, 0, x, y, z, 1];
};

const cases = JSON.parse(readFileSync(process.argv[2], "utf8"));
console.log(JSON.stringify(cases.map(({ cells, avatar, eye, yaw, heads }) => {
  const walker = new Walker({ ...worldOf(cells), avatar });
  walker.place({ eye, yaw, pitch: 0 });
  const body = new Body(walker, true);
  return heads.map(([x, y, z, turn, push]) => {
    const sources = [{ handedness: "left", gamepad: { axes: [0, -push] } }];
    walker.step(1 / 20, body.follow(matrix(x, y, z, turn), sources));
    return body.head;
  });
})));
