// Which cell holds a point (docs/formats/hints.md, "leaves").

import { Plane, Vector3 } from "three";

/**
 * @typedef {object} Leaf
 * @property {number[][]} points
 * @property {number[][]} faces loops of indices into the points, counter-clockwise from outside
 */

/**
 * The planes of a leaf, facing outwards.
 * @param {Leaf} leaf
 */
export function planesOf({ points, faces }) {
  return faces.map((loop) => {
    const corner = (/** @type {number} */ k) => new Vector3(...points[loop[k % loop.length]]);
    const normal = new Vector3();
    loop.forEach((_, k) => normal.add(corner(k).cross(corner(k + 1))));
    return new Plane().setFromNormalAndCoplanarPoint(normal.normalize(), corner(0));
  });
}

/**
 * Whether a point is behind all planes.
 * @param {Plane[]} planes
 * @param {Vector3} point
 * @param {number} slack metres
 */
export function holds(planes, point, slack) {
  return planes.every((plane) => plane.distanceToPoint(point) <= slack);
}

/**
 * Whether a point is in a box of the index.
 * @param {number[]} box
 * @param {Vector3} point
 * @param {number} slack metres
 */
export function near(box, point, slack) {
  return point.toArray().every((x, k) => box[k] - slack <= x && x <= box[k + 3] + slack);
}
