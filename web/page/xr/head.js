// The head of a visitor with a headset: no step in the room brings it nearer to a wall than the near plane
// needs. What ends below the head does not stop it, so one can lean over a table.
//
// Kneeling and getting up are never stopped, and may lead the head into an object. Then steps are free where
// the body's own eye is: they lead out of the object, and not through the walls of its room.

import { letThrough, outline, pushed } from "../walk/obstacles.js";
import { BLOCKS } from "../walk/solids.js";

/** The distance of the axis from walls, and half of the height of the head, m. */
const RADIUS = 0.2, HALF = 0.1;
/** A longer step between two pictures is none: the headset has found itself again, m. */
const LONGEST = 1;

/** Whether a surface is between two heights. @param {import("../walk/solids.js").Solids} solids
 * @param {number} x @param {number} z @param {number} bottom @param {number} top */
function parted(solids, x, z, bottom, top) {
  let parts = false;
  solids.near([x, bottom, z], [x, top, z], (corners, at, kind) => {
    parts ||= (kind & BLOCKS) > 0 && outline.cut(corners, at, bottom, top).distance(x, z) === 0;
  });
  return parts;
}

/**
 * Where a step leads that begins at a place.
 * @param {import("../walk/solids.js").Solids} solids
 * @param {number[]} head
 * @param {number} body height of the eye of the walker, which its own collisions keep free
 * @param {number} dx @param {number} dz
 * @returns {number[]} x, z
 */
export function stepOf(solids, [x, y, z], body, dx, dz) {
  const length = Math.hypot(dx, dz), parts = Math.ceil(length / (RADIUS / 2));
  if (!(length <= LONGEST)) return [x, z];
  const height = parted(solids, x, z, Math.min(y, body), Math.max(y, body)) ? body : y;
  const [bottom, top] = [height - HALF, height + HALF], reach = RADIUS + length / parts;
  /** @type {import("../walk/obstacles.js").Distance} */
  const distance = ({ corners, at }, u, w) => outline.cut(corners, at, bottom, top).distance(u, w);
  for (let part = 0; part < parts; part++) {
    /** @type {import("../walk/obstacles.js").Obstacle[]} */
    const near = [];
    solids.near([x - reach, bottom, z - reach], [x + reach, top, z + reach], (corners, at, kind) => {
      if (!(kind & BLOCKS)) return;
      const one = { corners, at, kind, now: 0 };
      one.now = distance(one, x, z);
      near.push(one);
    });
    const [u, w] = pushed(near, RADIUS, distance, x + dx / parts, z + dz / parts);
    if (!letThrough(near, RADIUS, distance, x, z, u, w)) break;
    x = u;
    z = w;
  }
  return [x, z];
}
