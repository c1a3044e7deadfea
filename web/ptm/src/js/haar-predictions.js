// What is known of a row of Haar differences before its first symbol: what each is expected to be, and
// by how lively its surroundings are, the table of its symbol.

/** @typedef {import("./haar-planes.js").Plane} Plane */

/** Classes of V and h; those of g follow. */
export const CLASSES = 14;

const PREDICTION_TOP = 1020;
const BOUNDS = [1, 3, 7, 12, 20, 32, 50, 76, 115, 170, 250, 370, 560];
const CLASS = Uint8Array.from({ length: 1024 }, (_, a) => BOUNDS.filter((b) => b <= a).length);

/**
 * @param {Plane} plane
 * @param {number} y
 * @param {number} bw
 */
export function gradient(plane, y, bw) {
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
export function refer(plane, k, planes, side, out) {
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
export function predictV(plane, y, { foretold, lively }, prediction, table) {
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
export function predictH(plane, y, { foretold, lively }, prediction, table) {
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
export function predictG(plane, y, { foretold, lively }, prediction, table) {
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
