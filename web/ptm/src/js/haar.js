// The Haar coder (docs/format-ptm.md, "Haar coder"): a row of one difference at a time, whose
// predictions and tables do not depend on the symbols of the row itself.

import { damaged } from "../errors.js";
import { geometricTables } from "../families.js";
import { Reader } from "../reader.js";
import { OPAQUE } from "../texels.js";
import { edgePlaces, median, planeOrder, references } from "./planes.js";
import { ESCAPE, Symbols, readTables } from "./rans.js";

const CLASSES = 14;
const EDGE_TABLE = 28;
const WEIGHT_TOP = 2047;
const PREDICTION_TOP = 1020;

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
const BOUNDS = [1, 3, 7, 12, 20, 32, 50, 76, 115, 170, 250, 370, 560];
const CLASS = Uint8Array.from({ length: 1024 }, (_, a) => BOUNDS.filter((b) => b <= a).length);

/** Values of a component coded by rank: ranks of all 256 values, and values of the ranks. */
class Ranks {
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
class Plane {
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
 * @param {Uint8Array} data behind the byte that names the coder
 * @param {Uint32Array} below
 * @param {import("../texels.js").Shape} shape
 */
export function decodeHaar(data, below, shape) {
  const { width, height, components } = shape;
  const bw = width >> 1;
  const bh = height >> 1;
  const reader = new Reader(data);
  const planes = readPlanes(reader, components, bw);
  const tables = readTables(reader, 2 * CLASSES + 1, geometricTables());
  const edge = edgePlaces(width, height);
  const symbols = new Symbols(reader, tables, Math.max(bw, edge.length * components));
  const out = new Uint32Array(width * height).fill(components === 3 ? OPAQUE : 0);
  const nothing = { foretold: new Int32Array(bw), lively: new Int32Array(bw) };
  const buffers = { foretold: new Int32Array(bw), lively: new Int32Array(bw) };
  const prediction = new Int32Array(bw);
  const table = new Uint8Array(bw);
  const decoded = new Int32Array(bw);

  if (bw && bh) {
    for (const plane of planes) for (let y = -2; y < 2; y++) loadRow(plane, below, bw, bh, y);
    for (let y = 0; y <= bh; y++) {
      const now = y & 1;
      for (const plane of planes) {
        if (y < bh) {
          loadRow(plane, below, bw, bh, y + 2);
          gradient(plane, y, bw);
        } else {
          plane.values[1][now].set(plane.values[1][1 - now]);
          plane.residuals[1][now].fill(0);
        }
        for (let k = 0; k < 3; k++) {
          const blockRow = k === 2 ? y - 1 : y;
          if (blockRow < 0 || blockRow === bh) continue;
          const side = blockRow & 1;
          const referred = plane.others ? refer(plane, k, planes, side, buffers) : nothing;
          if (k === 0) predictV(plane, y, referred, prediction, table);
          else if (k === 1) predictH(plane, y, referred, prediction, table);
          else predictG(plane, blockRow, referred, prediction, table);
          symbols.row(table, bw, decoded);
          symbols.check();
          absorb(symbols, decoded, prediction, plane.residuals[k][side], plane.values[k][side]);
        }
        if (y) rebuild(plane, y - 1, below, bw, width, out);
      }
    }
  }
  decodeEdge(symbols, edge, width, components, out);
  symbols.end();
  return out;
}

/**
 * @param {Reader} reader
 * @param {number} components
 * @param {number} bw
 */
function readPlanes(reader, components, bw) {
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

/**
 * A row of the level below, it and both its ends repeated outwards.
 * @param {Plane} plane
 * @param {Uint32Array} below
 * @param {number} bw
 * @param {number} bh
 * @param {number} y
 */
function loadRow(plane, below, bw, bh, y) {
  const row = plane.rows[y & 7];
  const { rank } = plane.ranks;
  const shift = 8 * plane.component;
  const from = Math.min(Math.max(y, 0), bh - 1) * bw;
  for (let x = 0; x < bw; x++) row[x + 2] = rank[(below[from + x] >>> shift) & 255];
  row[0] = row[1] = row[2];
  row[bw + 3] = row[bw + 2] = row[bw + 1];
}

/**
 * @param {Plane} plane
 * @param {number} y
 * @param {number} bw
 */
function gradient(plane, y, bw) {
  const north = plane.rows[(y - 1) & 7];
  const row = plane.rows[y & 7];
  const south = plane.rows[(y + 1) & 7];
  const out = plane.gradient[y & 1];
  for (let x = 0; x < bw; x++) {
    out[x] = Math.abs(row[x + 3] - row[x + 1]) + Math.abs(south[x + 2] - north[x + 2]);
  }
}

/**
 * @param {number} sum
 */
function clamped(sum) {
  const p = (sum + 128) >> 8;
  return p < -PREDICTION_TOP ? -PREDICTION_TOP : p > PREDICTION_TOP ? PREDICTION_TOP : p;
}

/**
 * Magnitudes of the residuals around in the row of blocks above.
 * @param {Int32Array} above
 * @param {number} x
 */
function near(above, x) {
  return 2 * Math.abs(above[x + 1]) + Math.abs(above[x]) + Math.abs(above[x + 2]);
}

/**
 * What a row takes from the planes that it refers to: parts of its predictions and activities.
 * @typedef {{foretold: Int32Array, lively: Int32Array}} Referred
 */

/**
 * @param {Plane} plane
 * @param {number} k
 * @param {Plane[]} planes
 * @param {number} side
 * @param {Referred} out overwritten
 */
function refer(plane, k, planes, side, out) {
  const { foretold, lively } = out;
  const r1 = planes[0].residuals[k][side];
  const r2 = planes[1].residuals[k][side];
  const [w1, w2] = plane.weights[k].slice(5);
  const [a1, a2] = plane.activities[k].slice(2);
  for (let x = 0; x < foretold.length; x++) {
    foretold[x] = w1 * r1[x + 1] + w2 * r2[x + 1];
    lively[x] = a1 * Math.abs(r1[x + 1]) + a2 * Math.abs(r2[x + 1]);
  }
  return out;
}

/**
 * Predictions and tables of a row of V.
 * @param {Plane} plane
 * @param {number} y
 * @param {Referred} referred
 * @param {Int32Array} prediction
 * @param {Uint8Array} table
 */
function predictV(plane, y, { foretold, lively }, prediction, table) {
  const { rows } = plane;
  const nn = rows[(y - 2) & 7];
  const n = rows[(y - 1) & 7];
  const i = rows[y & 7];
  const s = rows[(y + 1) & 7];
  const ss = rows[(y + 2) & 7];
  const above = plane.residuals[0][1 - (y & 1)];
  const slope = plane.gradient[y & 1];
  const [w0, w1, w2, w3] = plane.weights[0];
  const [a0, a1] = plane.activities[0];
  for (let x = 0; x < prediction.length; x++) {
    prediction[x] = clamped(
      w0 * (s[x + 2] - n[x + 2]) +
        w1 * (s[x + 1] - n[x + 1] + s[x + 3] - n[x + 3]) +
        w2 * (ss[x + 2] - i[x + 2]) +
        w3 * (i[x + 2] - nn[x + 2]) +
        foretold[x],
    );
    const a =
      (a0 * slope[x] +
        a1 * near(above, x) +
        lively[x]) >>
      6;
    table[x] = CLASS[a < 1023 ? a : 1023];
  }
}

/**
 * Of a row of h.
 * @param {Plane} plane
 * @param {number} y
 * @param {Referred} referred
 * @param {Int32Array} prediction
 * @param {Uint8Array} table
 */
function predictH(plane, y, { foretold, lively }, prediction, table) {
  const { rows } = plane;
  const n = rows[(y - 1) & 7];
  const i = rows[y & 7];
  const s = rows[(y + 1) & 7];
  const v = plane.values[0][y & 1];
  const ev = plane.residuals[0][y & 1];
  const above = plane.residuals[1][1 - (y & 1)];
  const slope = plane.gradient[y & 1];
  const [w0, w1, w2, w3] = plane.weights[1];
  const [a0, a1, , , a4] = plane.activities[1];
  for (let x = 0; x < prediction.length; x++) {
    prediction[x] = clamped(
      w0 * (i[x + 3] - i[x + 1]) +
        w1 * (n[x + 3] - n[x + 1]) +
        w2 * (s[x + 3] - s[x + 1]) +
        w3 * (v[x + 2] - v[x]) +
        foretold[x],
    );
    const a =
      (a0 * slope[x] +
        a1 * near(above, x) +
        lively[x] +
        a4 * Math.abs(ev[x + 1])) >>
      6;
    table[x] = CLASS[a < 1023 ? a : 1023];
  }
}

/**
 * Of a row of g.
 * @param {Plane} plane
 * @param {number} y
 * @param {Referred} referred
 * @param {Int32Array} prediction
 * @param {Uint8Array} table
 */
function predictG(plane, y, { foretold, lively }, prediction, table) {
  const side = y & 1;
  const i = plane.rows[y & 7];
  const s = plane.rows[(y + 1) & 7];
  const v = plane.values[0][side];
  const h = plane.values[1][side];
  const under = plane.values[1][1 - side];
  const ev = plane.residuals[0][side];
  const eh = plane.residuals[1][side];
  const ehUnder = plane.residuals[1][1 - side];
  const above = plane.residuals[2][1 - side];
  const slope = plane.gradient[side];
  const [w0, w1, w2, w3, w4] = plane.weights[2];
  const [a0, a1, , , a4, a5, a6] = plane.activities[2];
  for (let x = 0; x < prediction.length; x++) {
    prediction[x] = clamped(
      w0 * (i[x + 3] - i[x + 1]) +
        w1 * (s[x + 3] - s[x + 1]) +
        w2 * h[x + 1] +
        w3 * under[x + 1] +
        w4 * (v[x + 2] - v[x]) +
        foretold[x],
    );
    const a =
      (a0 * slope[x] +
        a1 * near(above, x) +
        lively[x] +
        a4 * Math.abs(ev[x + 1]) +
        a5 * Math.abs(eh[x + 1]) +
        a6 * Math.abs(ehUnder[x + 1])) >>
      6;
    table[x] = CLASSES + CLASS[a < 1023 ? a : 1023];
  }
}

/**
 * From symbols to residuals and differences.
 * @param {Symbols} symbols
 * @param {Int32Array} decoded
 * @param {Int32Array} prediction
 * @param {Int32Array} residual
 * @param {Int32Array} value
 */
function absorb(symbols, decoded, prediction, residual, value) {
  for (let x = 0; x < prediction.length; x++) {
    let z = decoded[x];
    if (z === ESCAPE) z = symbols.escaped();
    const e = (z >> 1) ^ -(z & 1);
    residual[x + 1] = e;
    value[x + 1] = e + prediction[x];
  }
}

/**
 * The texels of a row of blocks, one component.
 * @param {Plane} plane
 * @param {number} y
 * @param {Uint32Array} below
 * @param {number} bw
 * @param {number} width
 * @param {Uint32Array} out
 */
function rebuild(plane, y, below, bw, width, out) {
  const side = y & 1;
  const [v, h, g] = plane.values.map((rows) => rows[side]);
  const shift = 8 * plane.component;
  const row = plane.rows[y & 7];
  const ranked = plane.ranks.values.length > 0;
  let stray = 0;
  for (let x = 0, at = 2 * y * width; x < bw; x++, at += 2) {
    const vx = v[x + 1];
    const hx = h[x + 1];
    let p, q, r, s;
    if (ranked) {
      const mean = (below[y * bw + x] >>> shift) & 255;
      const d = 2 * g[x + 1] + ((vx ^ hx) & 1);
      const a = (d + vx + hx) >> 1;
      const b = a - hx;
      const u = lowestRank(plane.ranks, mean, a, b, d);
      const { values } = plane.ranks;
      [p, q, r, s] = [values[u + a], values[u + b], values[u + d], values[u]];
    } else {
      const t = (vx + (vx & 1)) >> 1;
      const top = 2 * row[x + 2] + ((hx ^ t) & 1) + t;
      const bottom = top - vx;
      p = (top + hx) >> 1;
      q = p - hx;
      const d = 2 * g[x + 1] + (bottom & 1);
      r = (bottom + d) >> 1;
      s = r - d;
      stray |= p | q | r | s;
    }
    out[at] |= p << shift;
    out[at + 1] |= q << shift;
    out[at + width] |= r << shift;
    out[at + width + 1] |= s << shift;
  }
  if (stray & ~255) throw damaged("its stream leads to impossible texels");
}

/**
 * The rank of s: of those that leave all four ranks within the values, the one with which these
 * have the mean. The sum of the values grows with it.
 * @param {Ranks} ranks
 * @param {number} mean
 * @param {number} a rank of p less that of s
 * @param {number} b of q
 * @param {number} d of r
 */
function lowestRank({ values, rank }, mean, a, b, d) {
  const least = Math.max(0, -a, -b, -d);
  const most = values.length - 1 - Math.max(0, a, b, d);
  const guess = rank[mean] - ((a + b + d + 2) >> 2);
  let u = Math.max(least, Math.min(guess, most));
  if (least <= most) {
    const excess = () => values[u] + values[u + a] + values[u + b] + values[u + d] - 4 * mean;
    while (u < most && excess() < 0) u++;
    while (u > least && excess() > 3) u--;
    if (excess() >> 2 === 0) return u;
  }
  throw damaged("its stream leads to impossible texels");
}

/**
 * @param {Symbols} symbols
 * @param {number[]} edge
 * @param {number} width
 * @param {number} components
 * @param {Uint32Array} out
 */
function decodeEdge(symbols, edge, width, components, out) {
  for (const at of edge) {
    const left = at % width > 0;
    const up = at >= width;
    // The one that is there, if the other is not; none of the two is 0.
    const w = left ? out[at - 1] : up ? out[at - width] : 0;
    const n = up ? out[at - width] : w;
    const nw = left && up ? out[at - width - 1] : n;
    let texel = components === 3 ? OPAQUE : 0;
    for (let shift = 0; shift < 8 * components; shift += 8) {
      const guess = median((w >>> shift) & 255, (n >>> shift) & 255, (nw >>> shift) & 255);
      const z = symbols.plain(EDGE_TABLE);
      texel |= ((guess + ((z >> 1) ^ -(z & 1))) & 255) << shift;
    }
    out[at] = texel;
  }
}
