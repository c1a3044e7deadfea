// Obstacles around an upright cylinder: none comes nearer to its axis than the radius, or than it already is.

/** Passes in which walls push the axis; m that they push too far, and that count as 0. */
const PUSHES = 6, AWAY = 1e-6, SAME = 1e-9;

/** A triangle, its highest point, and how far it is from the axis now.
 * @typedef {{corners: Float32Array, at: number, kind: number, top: number, now: number}} Obstacle
 */
/** A cylinder: the distance of its axis from an obstacle is that of the outline, which then has the nearest point.
 * @typedef {object} Cylinder
 * @property {number} radius
 * @property {import("./outline.js").Outline} outline
 * @property {(one: Obstacle, x: number, z: number) => number} distance
 */

/**
 * Where obstacles push the axis from a place.
 * @param {Cylinder} cylinder @param {Obstacle[]} obstacles @param {number} x @param {number} z
 */
export function pushed({ radius, outline, distance }, obstacles, x, z) {
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
 * @param {Cylinder} cylinder @param {Obstacle[]} obstacles
 * @param {number} u @param {number} w @param {number} x @param {number} z
 */
export function letThrough({ radius, outline, distance }, obstacles, u, w, x, z) {
  const way = Math.hypot(x - u, z - w);
  return obstacles.every((one) => {
    if (distance(one, x, z) < Math.min(radius, one.now) - SAME) return false;
    return one.now === 0 || one.now > way || !outline.crosses(u, w, x, z);
  });
}
