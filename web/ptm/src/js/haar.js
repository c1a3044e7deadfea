// The Haar coder (docs/formats/ptm.md, "Haar coder"): a row of one difference at a time, whose
// predictions and tables do not depend on the symbols of the row itself.

import { damaged } from "../errors.js";
import { geometricTables } from "../families.js";
import { Reader } from "../reader.js";
import { OPAQUE } from "../texels.js";
import { readPlanes } from "./haar-planes.js";
import { CLASSES, gradient, predictG, predictH, predictV, refer } from "./haar-predictions.js";
import { edgePlaces, median } from "./planes.js";
import { ESCAPE, Symbols, readTables } from "./rans.js";

/** @typedef {import("./haar-planes.js").Plane} Plane */
/** @typedef {import("./haar-planes.js").Ranks} Ranks */

const EDGE_TABLE = 28;

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
