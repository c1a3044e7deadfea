// Points and directions of three numbers.

/** @typedef {ArrayLike<number>} Vector */

/** @param {Vector} a @param {Vector} b */
export function dot(a, b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/** @param {Vector} a @param {Vector} b */
export function cross(a, b) {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

/** @param {Vector} a @param {Vector} b */
export function minus(a, b) {
  return [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
}

/**
 * The normal of a polygon, as long as twice its area.
 * @param {Vector[]} points counter-clockwise, seen from there
 */
export function facing(points) {
  const sum = [0, 0, 0];
  points.forEach((point, i) => {
    const part = cross(point, points[(i + 1) % points.length]);
    for (let k = 0; k < 3; k++) sum[k] += part[k];
  });
  return sum;
}
