// The triangles that a walker can collide with: those of the loaded cells, in a tree for each cell.
//
// A triangle within 45° of level carries the walker. Any other one blocks the way, unless it lies in the
// opening of a portal, where a door hangs.

/** @typedef {import("../data/glb.js").Shape} Shape */
/** @typedef {{portals: {polygon: number[][]}[]}} Openings */
/** The corners are x, y, z three times from `at` on.
 * @typedef {(corners: Float32Array, at: number, kind: number) => void} Visit */

/** Kinds of triangles: a sum of these. */
export const BLOCKS = 1;
export const CARRIES = 2;
/** Largest distance of a door from the plane of its portal, and its largest excess width, m. */
const DEEP = 0.25, WIDER = 0.1;
/** Least distance of its middle inside the opening, so that the sides of the opening are no doors, m. */
const INSIDE = 0.03;
const FEW = 4;
/** Triangles that are processed without a pause. */
const AT_ONCE = 64, MANY = 1 << 14;
/** Number of cells kept out of sight. */
const MOST = 64;

/**
 * The distance of a point inside a polygon (negative: outside), if it is near enough to its plane for a
 * door; null if the polygon is horizontal.
 * @param {number[][]} polygon convex
 * @returns {((x: number, y: number, z: number) => number) | null}
 */
function openingOf(polygon) {
  const [[x0, y0, z0]] = polygon;
  let nx = 0, ny = 0, nz = 0;
  polygon.forEach(([x, y, z], k) => {
    const [u, v, w] = polygon[(k + 1) % polygon.length];
    nx += (y - v) * (z + w);
    ny += (z - w) * (x + u);
    nz += (x - u) * (y + v);
  });
  const size = Math.hypot(nx, ny, nz);
  if (!(Math.abs(ny) < 0.7 * size)) return null;
  nx /= size;
  ny /= size;
  nz /= size;
  const edges = polygon.map(([x, y, z], k) => {
    const [u, v, w] = polygon[(k + 1) % polygon.length];
    const a = u - x, b = v - y, c = w - z, length = Math.hypot(a, b, c) || 1;
    const inward = [ny * c - nz * b, nz * a - nx * c, nx * b - ny * a].map((v) => v / length);
    return [...inward, inward[0] * x + inward[1] * y + inward[2] * z];
  });
  return (x, y, z) => {
    if (Math.abs(nx * (x - x0) + ny * (y - y0) + nz * (z - z0)) > DEEP) return -Infinity;
    return edges.reduce((far, [a, b, c, d]) => Math.min(far, a * x + b * y + c * z - d), Infinity);
  };
}

/** Triangles in a tree: nodes in depth-first order, each with the index of the next node that is not
 * below it. It is built step by step: thousands of triangles take longer than a frame. */
class Tree {
  corners = new Float32Array(0);
  kinds = new Uint8Array(0);
  order = new Uint32Array(0);
  boxes = new Float32Array(0);
  next = new Uint32Array(0);
  /** First and last triangle of a node without others below it. */
  ranges = new Uint32Array(0);
  count = 0;

  /** @param {Shape[]} shapes @param {Openings} record */
  constructor(shapes, record) {
    this.shapes = shapes;
    this.steps = this.#make(shapes, record);
  }

  /** @param {Shape[]} shapes @param {Openings} record */
  *#make(shapes, { portals }) {
    const openings = portals.map(({ polygon }) => openingOf(polygon)).filter((one) => one !== null);
    const most = shapes.reduce((sum, { indices }) => sum + indices.length / 3, 0);
    this.corners = new Float32Array(9 * most);
    this.kinds = new Uint8Array(most);
    let count = 0;
    for (const { positions, indices } of shapes) {
      for (let k = 0; k + 2 < indices.length; k += 3) {
        if (k % (3 * AT_ONCE) === 0) yield;
        const p = this.corners.subarray(9 * count, 9 * count + 9);
        for (let n = 0; n < 9; n++) p[n] = positions[3 * indices[k + Math.floor(n / 3)] + (n % 3)];
        const ax = p[3] - p[0], ay = p[4] - p[1], az = p[5] - p[2];
        const bx = p[6] - p[0], by = p[7] - p[1], bz = p[8] - p[2];
        const level = Math.hypot(ay * bz - az * by, ax * by - ay * bx);
        const upright = Math.abs(az * bx - ax * bz);
        if (level + upright === 0) continue;
        const [x, y, z] = [0, 1, 2].map((n) => (p[n] + p[n + 3] + p[n + 6]) / 3);
        const door = openings.some((inside) => inside(x, y, z) > INSIDE
          && [0, 3, 6].every((n) => inside(p[n], p[n + 1], p[n + 2]) > -WIDER));
        this.kinds[count] = (door ? 0 : BLOCKS) + (level <= upright ? CARRIES : 0);
        if (this.kinds[count] > 0) count++;
      }
    }
    this.order = new Uint32Array(count);
    for (let k = 0; k < count; k++) this.order[k] = k;
    this.boxes = new Float32Array(12 * count + 6);
    this.next = new Uint32Array(2 * count + 1);
    this.ranges = new Uint32Array(4 * count + 2);
    // Work left, the next at the end; between the items nodes that are finished then.
    const left = count ? [{ begin: 0, end: count, over: -1 }] : [];
    for (let next = left.pop(); next; next = left.pop()) {
      const { begin, end, over } = next;
      if (over >= 0) {
        this.next[over] = this.count;
        continue;
      }
      yield;
      const node = this.count, split = yield* this.#node(begin, end);
      left.push({ begin, end, over: node });
      if (split < end) left.push({ begin: split, end, over: -1 }, { begin, end: split, over: -1 });
    }
  }

  /**
   * Makes a node of triangles; returns the place at which they are divided, or `end`.
   * @param {number} begin @param {number} end
   * @returns {Generator<void, number, void>}
   */
  *#node(begin, end) {
    const { corners, order } = this, node = this.count++;
    const box = this.boxes.subarray(6 * node, 6 * node + 6).fill(Infinity, 0, 3).fill(-Infinity, 3);
    for (let k = begin; k < end; k++) {
      if ((k - begin) % MANY === MANY - 1) yield;
      for (let n = 0; n < 9; n++) {
        const value = corners[9 * order[k] + n], axis = n % 3;
        if (value < box[axis]) box[axis] = value;
        if (value > box[3 + axis]) box[3 + axis] = value;
      }
    }
    if (end - begin <= FEW) {
      this.ranges[2 * node] = begin;
      this.ranges[2 * node + 1] = end;
      return end;
    }
    const sizes = [box[3] - box[0], box[4] - box[1], box[5] - box[2]];
    const axis = sizes.indexOf(Math.max(...sizes)), middle = 1.5 * (box[axis] + box[3 + axis]);
    let split = begin;
    for (let k = begin; k < end; k++) {
      if ((k - begin) % MANY === MANY - 1) yield;
      const one = order[k], at = 9 * one + axis;
      if (corners[at] + corners[at + 3] + corners[at + 6] >= middle) continue;
      order[k] = order[split];
      order[split++] = one;
    }
    return split === begin || split === end ? (begin + end) >> 1 : split;
  }

  /** @param {number[]} low @param {number[]} high @param {Visit} visit */
  visit(low, high, visit) {
    const { boxes, order } = this;
    for (let node = 0; node < this.count; ) {
      const at = 6 * node;
      const meets = [0, 1, 2].every((k) => boxes[at + k] <= high[k] && boxes[at + 3 + k] >= low[k]);
      for (let k = this.ranges[2 * node]; meets && k < this.ranges[2 * node + 1]; k++) {
        visit(this.corners, 9 * order[k], this.kinds[order[k]]);
      }
      node = meets ? node + 1 : this.next[node];
    }
  }
}

/** The triangles of the loaded cells. */
export class Solids {
  /** @type {Map<number, Tree>} */
  #trees = new Map();
  /** @type {Map<number, Tree>} of cells that are being added */
  #growing = new Map();

  /**
   * Adds a cell, or as much of it as time permits: it counts once it is complete, by further
   * calls; true if it is.
   * @param {number} cell @param {Shape[]} shapes @param {Openings} record
   * @param {() => boolean} [late] whether the time has come
   */
  add(cell, shapes, record, late = () => false) {
    // Other shapes have to wait: meshes may arrive faster than a tree grows.
    const tree = this.#growing.get(cell) ?? new Tree(shapes, record);
    this.#growing.set(cell, tree);
    while (!tree.steps.next().done) if (late()) return false;
    this.#growing.delete(cell);
    this.#trees.set(cell, tree);
    return true;
  }

  /** Forgets all but some cells, once they are many. @param {Set<number>} cells */
  keep(cells) {
    if (this.#trees.size < MOST) return;
    for (const trees of [this.#trees, this.#growing]) {
      for (const cell of trees.keys()) if (!cells.has(cell)) trees.delete(cell);
    }
  }

  /** Whether a cell was added, with these shapes. @param {number} cell @param {Shape[]} [shapes] */
  has(cell, shapes) {
    const tree = this.#trees.get(cell);
    return tree !== undefined && (tree.shapes === shapes || !shapes);
  }

  /**
   * Visits all triangles that may meet a box, and some that do not.
   * @param {number[]} low @param {number[]} high @param {Visit} visit
   */
  near(low, high, visit) {
    for (const tree of this.#trees.values()) tree.visit(low, high, visit);
  }
}
