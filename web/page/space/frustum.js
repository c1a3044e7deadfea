// The frustum of a camera, and tests of boxes and hulls against it.

import { cross } from "../../client/src/vectors.js";

/** @typedef {ArrayLike<number>} Numbers */

/**
 * @typedef {object} Frustum
 * @property {number[]} eye
 * @property {number[]} direction
 * @property {number[]} right
 * @property {number[]} up
 * @property {Float64Array} planes inward normals, through the eye, x, y, z of each: of the left,
 *   the right, the lower and the upper side, and of the half space ahead
 */

/** @typedef {{eye: number[], yaw: number, pitch: number}} Pose metres, radians: see `directionOf` */

/**
 * Yaw 0 looks along −z and grows to the left, pitch grows upwards.
 * @param {number} yaw
 * @param {number} pitch
 */
export function directionOf(yaw, pitch) {
  const level = Math.cos(pitch);
  return [-Math.sin(yaw) * level, Math.sin(pitch), -Math.cos(yaw) * level];
}

/**
 * @param {Pose} pose
 * @param {number} angle vertical, radians
 * @param {number} aspect width by height
 * @returns {Frustum}
 */
export function frustumOf({ eye, yaw, pitch }, angle, aspect) {
  const direction = directionOf(yaw, pitch);
  const right = [Math.cos(yaw), 0, -Math.sin(yaw)];
  const up = cross(right, direction);
  const tall = Math.tan(angle / 2), wide = tall * aspect;
  /** @param {number} slope @param {number[]} side @param {number} sign */
  const plane = (slope, side, sign) => direction.map((ahead, i) => ahead * slope + sign * side[i]);
  const planes = Float64Array.from([
    ...plane(wide, right, 1), ...plane(wide, right, -1),
    ...plane(tall, up, 1), ...plane(tall, up, -1), ...direction,
  ]);
  return { eye: [...eye], direction, right, up, planes };
}

/**
 * Whether a box reaches into a frustum; some that just pass by a corner count, too.
 * @param {Frustum} frustum
 * @param {Numbers} low
 * @param {Numbers} high
 * @param {number} [at] index of the corner in `low`
 * @param {number} [to]
 */
export function meetsBox({ eye, planes }, low, high, at = 0, to = at) {
  for (let p = 0; p < planes.length; p += 3) {
    let along = 0;
    for (let i = 0; i < 3; i++) {
      const normal = planes[p + i];
      // The corner that is farthest along the normal.
      along += ((normal > 0 ? high[to + i] : low[at + i]) - eye[i]) * normal;
    }
    if (!(along > 0)) return false;
  }
  return true;
}

/**
 * Whether the convex hull of points reaches into a frustum; see `meetsBox`.
 * @param {Frustum} frustum
 * @param {Numbers} points x, y, z of each
 */
export function meetsHull({ eye, planes }, points) {
  for (let p = 0; p < planes.length; p += 3) {
    let inside = false;
    for (let i = 0; i < points.length && !inside; i += 3) {
      inside = (points[i] - eye[0]) * planes[p] + (points[i + 1] - eye[1]) * planes[p + 1]
        + (points[i + 2] - eye[2]) * planes[p + 2] > 0;
    }
    if (!inside) return false;
  }
  return true;
}

/**
 * Metres from an eye to the nearest point of a box.
 * @param {Numbers} eye
 * @param {Numbers} low
 * @param {Numbers} high
 * @param {number} [at] see `meetsBox`
 * @param {number} [to]
 */
export function distance(eye, low, high, at = 0, to = at) {
  let square = 0;
  for (let i = 0; i < 3; i++) {
    const beside = Math.max(low[at + i] - eye[i], eye[i] - high[to + i], 0);
    square += beside * beside;
  }
  return Math.sqrt(square);
}
