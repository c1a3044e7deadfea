// Obstacles around an upright cylinder: none comes nearer to its axis than the radius, or than it already is.

import { Outline } from "./outline.js";

/** Passes in which walls push the axis; m that they push too far, and that count as 0. */
const PUSHES = 6, AWAY = 1e-6, SAME = 1e-9;

/** A triangle, and how far it is from the axis now.
 * @typedef {{corners: Float32Array, at: number, kind: number, now: number}} Obstacle
 */
/** The distance of the axis at a place, by `outline`, which then has the nearest point.
 * @typedef {(one: Obstacle, x: number, z: number) => number} Distance
 */

/** Of the last distance. */
export const outline = new Outline();

/**
 * Where obstacles push the axis from a place.
 * @param {Obstacle[]} obstacles @param {number} radius @param {Distance} distance @param {number} x @param {number} z
 */
export function pushed(obstacles, radius, distance, x, z) {
  for (let push = 0; push < PUSHES; push++) {
    let worst = AWAY / 2, u = x, w = z;
    for (const one of obstacles) {
      const far = distance(one, x, z), lacks = Math.min(radius, one.now) - far;
      if (lacks <= worst || far === 0) continue;
      worst = lacks;
      const share = (lacks + AWAY) / far;
      u = x + share * (x - outline.x);
      w = z + share * (z - outline.z);
    }
    if (u === x && w === z) break;
    x = u;
    z = w;
  }
  return [x, z];
}

/**
 * Whether obstacles let the axis go from u, w to x, z.
 * @param {Obstacle[]} obstacles @param {number} radius @param {Distance} distance
 * @param {number} u @param {number} w @param {number} x @param {number} z
 */
export function letThrough(obstacles, radius, distance, u, w, x, z) {
  const way = Math.hypot(x - u, z - w);
  return obstacles.every((one) => {
    if (distance(one, x, z) < Math.min(radius, one.now) - SAME) return false;
    return one.now === 0 || one.now > way || !outline.crosses(u, w, x, z);
  });
}
