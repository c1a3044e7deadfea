// What a group of the Haar coder says of its planes: ranks and weights; and what is kept of each.

import { damaged } from "../errors.js";
import { planeOrder, references } from "./planes.js";

/** @typedef {import("../reader.js").Reader} Reader */

const WEIGHT_TOP = 2047;

// In 1/256, for planes with 0, 1, 2 references: V, h, g.
const WEIGHTS = [
  [[-158, -5, 31, 29, 0, 0, 0], [-79, 5, 6, -18, 0, 0, 0], [-22, 10, 44, 44, 10, 0, 0]],
  [[-167, -2, 32, 32, 0, 241, 0], [-78, 1, 4, -18, 0, 241, 0], [-19, 10, 47, 49, 9, 235, 0]],
  [[-152, -7, 25, 22, 0, 236, 35], [-78, 0, 3, -18, 0, 236, 28], [-19, 9, 46, 46, 10, 228, 70]],
];
const ACTIVITIES = [
  [[154, 139, 0, 0, 0, 0, 0], [61, 153, 0, 0, 25, 0, 0], [11, 67, 0, 0, 22, 66, 88]],
  [[9, 98, 36, 0, 0, 0, 0], [3, 99, 51, 0, 60, 0, 0], [1, 27, 57, 0, 17, 50, 49]],
  [[8, 74, 31, 128, 0, 0, 0], [3, 88, 23, 131, 38, 0, 0], [1, 24, 20, 61, 25, 39, 55]],
];

/** Values of a component coded by rank: ranks of all 256 values, and values of the ranks. */
export class Ranks {
  /** @param {Uint8Array | null} bitmap */
  constructor(bitmap) {
    /** @type {number[]} */
    this.values = [];
    this.rank = Int32Array.from({ length: 256 }, (_, value) => value);
    if (!bitmap) return;
    for (let v = 0; v < 256; v++) if ((bitmap[v >> 3] >> (v & 7)) & 1) this.values.push(v);
    if (this.values.length < 2) throw damaged("a rank bitmap has fewer than two values");
    for (let v = 0, i = 0; v < 256; v++) {
      while (i + 1 < this.values.length && (this.values[i] + this.values[i + 1]) >> 1 < v) i++;
      this.rank[v] = i;
    }
  }
}

/** What is kept of a plane: of blocks two rows, of the level below eight. */
export class Plane {
  /**
   * @param {number} component
   * @param {number} others how many planes it refers to
   * @param {number[][]} weights
   * @param {Ranks} ranks
   * @param {number} bw blocks in a row
   */
  constructor(component, others, weights, ranks, bw) {
    const row = () => new Int32Array(bw + 2);
    this.component = component;
    this.others = others;
    this.weights = weights;
    this.activities = ACTIVITIES[others];
    this.ranks = ranks;
    /** Ranks of the level below, from two before the row on. */
    this.rows = Array.from({ length: 8 }, () => new Int32Array(bw + 4));
    this.gradient = [row(), row()];
    /** V, h, g and their residuals of block rows y and y - 1, from one before the row on. */
    this.values = [0, 1, 2].map(() => [row(), row()]);
    this.residuals = [0, 1, 2].map(() => [row(), row()]);
  }
}

/**
 * Flags, ranks and weights.
 * @param {Reader} reader
 * @param {number} components
 * @param {number} bw
 */
export function readPlanes(reader, components, bw) {
  const flags = reader.number(1);
  if (flags & ~(1 | (((1 << components) - 1) << 4))) throw damaged(`flags ${flags} are unknown`);
  /** @type {Ranks[]} */
  const ranks = [];
  for (let c = 0; c < components; c++) {
    ranks.push(new Ranks((flags >> (4 + c)) & 1 ? reader.take(32) : null));
  }
  return planeOrder(components).map((component, i) => {
    const others = references(components, i);
    const weights = WEIGHTS[others].map((own, k) => (flags & 1 ? readWeights(reader, k, others) : own));
    return new Plane(component, others, weights, ranks[component], bw);
  });
}

/**
 * @param {Reader} reader
 * @param {number} k
 * @param {number} others
 */
function readWeights(reader, k, others) {
  const weights = [0, 0, 0, 0, 0, 0, 0];
  for (let i = 0; i < 5 + others; i++) {
    if (i !== 4 || k === 2) weights[i] = reader.signed();
    if (Math.abs(weights[i]) > WEIGHT_TOP) throw damaged("a weight is out of range");
  }
  return weights;
}
