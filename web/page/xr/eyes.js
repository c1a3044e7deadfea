// The eyes of a headset as cameras of the page, and the view that has all that they see: the policy, the item
// buffer and the choice of cells work with one view.

/** @typedef {import("../gl/camera.js").Camera} Camera */
/** @typedef {import("../walk/walker.js").Pose} Pose */
/**
 * An eye in the world.
 * @typedef {object} Eye
 * @property {number[]} place
 * @property {number[][]} axes to the right, up and back, unit vectors
 * @property {ArrayLike<number>} projection 4 x 4, by columns, of WebGL
 * @property {number} lines of its picture
 */

/** The largest slope of the view to a side, and the least share of an eye's ray along it: of 80 degrees. */
const STEEPEST = 5.67, AHEAD = 0.174;

/** @param {number[]} a @param {number[]} b */
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
/** Sum of multiples of vectors. @param {number[][]} vectors @param {number[]} shares */
const sum = (vectors, shares) => [0, 1, 2].map((k) => vectors.reduce((all, one, n) => all + shares[n] * one[k], 0));

/** A vector turned to the left. @param {number[]} vector @param {number} yaw radians */
export function turned([x, y, z], yaw) {
  const s = Math.sin(yaw), c = Math.cos(yaw);
  return [c * x + s * z, y, c * z - s * x];
}

/** Yaw and pitch of a head; its roll has no influence. @param {number[][]} axes see `Eye` */
export function headingOf([right, , back]) {
  const yaw = Math.atan2(-right[2], right[0]);
  return { yaw, pitch: Math.atan2(-back[1], back[0] * Math.sin(yaw) + back[2] * Math.cos(yaw)) };
}

/** The axes of a matrix of WebXR. @param {ArrayLike<number>} m 4 x 4, by columns */
export const axesOf = (m) => [0, 4, 8].map((k) => [m[k], m[k + 1], m[k + 2]]);

/**
 * The camera of an eye. Its middle may lie off the axis, which is a shear before the projection.
 * @param {Eye} eye
 * @returns {Camera}
 */
export function cameraOfEye({ place, axes: [right, up, back], projection: p }) {
  const x = sum([right, back], [1, p[8] / p[0]]), y = sum([up, back], [1, p[9] / p[5]]);
  const turn = [0, 1, 2].flatMap((k) => [x[k], y[k], back[k]]);
  return { eye: place, turn, lens: [p[0], p[5], p[10], p[14]] };
}

/**
 * The symmetric view of a head that has everything in the views of its eyes: its apex lies behind them.
 * @param {readonly Eye[]} eyes
 * @param {Pose} head
 */
export function unionOf(eyes, { eye: middle, yaw, pitch }) {
  const s = Math.sin(yaw), c = Math.cos(yaw), sp = Math.sin(pitch), cp = Math.cos(pitch);
  const right = [c, 0, -s], up = [s * sp, cp, c * sp], back = [s * cp, -sp, c * cp];
  let wide = 0, tall = 0;
  for (const { axes, projection: p } of eyes) {
    for (const [u, v] of [[-1, -1], [1, -1], [-1, 1], [1, 1]]) {
      const ray = sum(axes, [(u + p[8]) / p[0], (v + p[9]) / p[5], -1]);
      const ahead = Math.max(-dot(ray, back), AHEAD * Math.hypot(...ray));
      wide = Math.max(wide, Math.abs(dot(ray, right)) / ahead);
      tall = Math.max(tall, Math.abs(dot(ray, up)) / ahead);
    }
  }
  wide = Math.min(wide, STEEPEST);
  tall = Math.min(tall, STEEPEST);
  let behind = 0, lines = 0;
  for (const { place, projection, lines: own } of eyes) {
    const off = place.map((x, k) => x - middle[k]);
    const beside = Math.max(Math.abs(dot(off, right)) / wide, Math.abs(dot(off, up)) / tall);
    behind = Math.max(behind, dot(off, back) + beside);
    lines = Math.max(lines, own * projection[5] * tall);
  }
  return {
    pose: { eye: sum([middle, back], [1, behind]), yaw, pitch },
    tall: 2 * Math.atan(tall),
    aspect: wide / tall,
    lines,
  };
}
