// The matrices of a view, in the form of the programs.

/**
 * @typedef {object} Pose
 * @property {number[]} eye
 * @property {number} yaw radians, 0 along -z, growing to the left
 * @property {number} pitch radians, growing upwards
 *
 * @typedef {object} Camera
 * @property {number[]} eye
 * @property {number[]} turn 3 x 3 from the world to the view, by columns
 * @property {number[]} lens of x, of y, and scale and offset of depth
 */

/** Near plane, metres: less than half of the distance that walls keep from the eye. */
const NEAR = 0.1;

/**
 * @param {Pose} pose
 * @param {number} angle vertical field of view, radians
 * @param {number} aspect width over height
 * @param {number} far metres
 * @returns {Camera}
 */
export function cameraOf({ eye, yaw, pitch }, angle, aspect, far) {
  const [s, c, sp, cp] = [Math.sin(yaw), Math.cos(yaw), Math.sin(pitch), Math.cos(pitch)];
  const turn = [c, s * sp, s * cp, 0, cp, -sp, -s, c * sp, c * cp];
  const tall = 1 / Math.tan(angle / 2);
  const depth = NEAR - far;
  return { eye, turn, lens: [tall / aspect, tall, (far + NEAR) / depth, (2 * far * NEAR) / depth] };
}
