// Finds the portal that a movement passes.

import { cross, dot, facing, minus } from "../../client/src/vectors.js";

/** @typedef {ArrayLike<number>} Vector */
/** @typedef {{neighbour: number, polygon: number[][]}} Portal */

/**
 * The share of a way up to a convex polygon; Infinity if the way does not lead through.
 * @param {Vector} eye its start
 * @param {Vector} way
 * @param {number[][]} polygon
 */
export function crossing(eye, way, polygon) {
  const normal = facing(polygon), along = dot(normal, way);
  const share = dot(normal, minus(polygon[0], eye)) / along;
  if (along === 0 || !(share >= 0 && share <= 1)) return Infinity;
  const beside = polygon.map((point) => point.map((x, i) => x - (eye[i] + share * way[i])));
  const sides = beside.map((a, i) => dot(cross(a, beside[(i + 1) % beside.length]), normal));
  return sides.every((side) => side >= 0) || sides.every((side) => side <= 0) ? share : Infinity;
}

/**
 * The cell behind the first portal that a way leads through, or −1.
 * @param {Portal[]} portals
 * @param {Vector} eye
 * @param {Vector} way
 */
export function nextCell(portals, eye, way) {
  let next = -1, nearest = Infinity;
  for (const { neighbour, polygon } of portals) {
    const far = crossing(eye, way, polygon);
    if (far < nearest) [next, nearest] = [neighbour, far];
  }
  return next;
}
