// Outlines of triangles for an upright cylinder: cut to a range of heights and projected on the
// floor.

/** A convex polygon in x and z; mostly a wall, then as thin as a line. */
export class Outline {
  /** @type {number[]} x, y, z of each corner */
  #points = [];
  /** The nearest point of the last query. */
  x = 0;
  z = 0;

  /**
   * The part of a triangle between two heights.
   * @param {Float32Array} corners @param {number} at @param {number} bottom @param {number} top
   */
  cut(corners, at, bottom, top) {
    this.#points = [...corners.subarray(at, at + 9)];
    this.#clip(1, bottom);
    this.#clip(-1, -top);
    return this;
  }

  /** Keeps where side · y >= bound. @param {number} side @param {number} bound */
  #clip(side, bound) {
    const from = this.#points, kept = [];
    for (let k = 0, last = from.length - 3; k < from.length; last = k, k += 3) {
      const a = side * from[last + 1] - bound, b = side * from[k + 1] - bound;
      if (a < 0 !== b < 0) {
        const t = a / (a - b);
        for (let n = 0; n < 3; n++) kept.push(from[last + n] + t * (from[k + n] - from[last + n]));
      }
      if (b >= 0) kept.push(from[k], from[k + 1], from[k + 2]);
    }
    this.#points = kept;
  }

  /** The distance of a point outside; infinite if the outline is empty.
   * @param {number} x @param {number} z */
  distance(x, z) {
    const p = this.#points;
    let best = Infinity, left = 0, right = 0;
    for (let k = 0, last = p.length - 3; k < p.length; last = k, k += 3) {
      const ex = p[k] - p[last], ez = p[k + 2] - p[last + 2];
      const ax = x - p[last], az = z - p[last + 2];
      const side = ex * az - ez * ax;
      if (side > 0) left++;
      if (side < 0) right++;
      const t = Math.max(0, Math.min(1, (ex * ax + ez * az) / (ex * ex + ez * ez || 1)));
      const far = Math.hypot(ax - t * ex, az - t * ez);
      if (far >= best) continue;
      best = far;
      this.x = p[last] + t * ex;
      this.z = p[last + 2] + t * ez;
    }
    if (left + right === 0 || (left && right)) return best;
    this.x = x;
    this.z = z;
    return 0;
  }

  /** Whether a line between two points meets it. @param {number} x @param {number} z
   * @param {number} u @param {number} w */
  crosses(x, z, u, w) {
    const p = this.#points;
    const side = (/** @type {number} */ k) => (u - x) * (p[k + 2] - z) - (w - z) * (p[k] - x);
    for (let k = 0, last = p.length - 3; k < p.length; last = k, k += 3) {
      const ex = p[k] - p[last], ez = p[k + 2] - p[last + 2];
      const from = ex * (z - p[last + 2]) - ez * (x - p[last]);
      const to = ex * (w - p[last + 2]) - ez * (u - p[last]);
      if (from * to <= 0 && side(last) * side(k) <= 0 && (from || to)) return true;
    }
    return false;
  }
}
