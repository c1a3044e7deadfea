// The outline of a cell on a plan.

/**
 * The convex hull of points, seen from above: x and z of its corners (Andrew's monotone chain).
 * @param {number[][]} points
 */
export function footprintOf(points) {
  const flat = points.map(([x, , z]) => [x, z]).sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  /** @param {number[][]} row */
  const half = (row) => {
    /** @type {number[][]} */
    const hull = [];
    for (const p of row) {
      while (hull.length > 1 && turn(hull[hull.length - 2], hull[hull.length - 1], p) <= 0) hull.pop();
      hull.push(p);
    }
    return hull.slice(0, -1);
  };
  return [...half(flat), ...half(flat.reverse())];
}

/** @param {number[]} a @param {number[]} b @param {number[]} c */
function turn(a, b, c) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}
