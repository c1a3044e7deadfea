// Sizes of everything that can be fetched, as arrays from the index. A texture holds column k if it has
// the levels 0 to k − 1; column 0 is nothing. Tables of T textures and K columns are flat, texture by
// texture; after a texture's last column they repeat it. The `.ptm` has exact levels up to a column;
// each of P previews, an image of one level, gives all columns up to its own with an error. Tables of
// worth have T + P rows: those of the textures, then those of the previews (docs/formats/client.md).

import { levelSizes } from "../../client/src/levels.js";
import { AVERAGING, LEAST_DIFFERENCE } from "./constants.js";
import { meshesOf } from "./meshes.js";

/**
 * @typedef {object} Catalogue
 * @property {number} T textures
 * @property {number} C cells
 * @property {number} K columns, that of nothing included
 * @property {Int32Array} levels (T) of each texture
 * @property {Int32Array} stored (T) those of its `.ptm`
 * @property {Float64Array} ends (T × K) bytes of the `.ptm` that hold each column
 * @property {Float64Array} memory (T × K) bytes of texture memory that each column takes
 * @property {Float64Array} differences (T × K) of each column to the one before it, 0 to 255; of
 *   columns after the last 0
 * @property {Float64Array} gains ((T + P) × K) of columns by each source: the differences, and for
 *   a preview the differences less its error
 * @property {Previews} previews
 * @property {Float64Array} colors (T × 3) mean colour, 0 to 255
 * @property {Float64Array} low (C × 3) corner of the box of each cell, metres
 * @property {Float64Array} high (C × 3)
 * @property {Float64Array} recordBytes (C) on the link
 * @property {Float64Array} geometryBytes (C)
 * @property {import("./meshes.js").FinerMesh[]} meshes the files of finer meshes of objects
 * @property {number} whole bytes of texture memory that all textures take
 */

/**
 * The previews of all textures, in the order of the index.
 * @typedef {object} Previews
 * @property {Int32Array} first (T + 1) number of the first preview of each texture
 * @property {Int32Array} column (P) the finest column that each gives
 * @property {Float64Array} bytes (P)
 * @property {Float64Array} loss (P) error of each in the empty column, from which that of column k is
 *   AVERAGING ** −k times as much: the less, the closer are all of its columns; of exact previews 0
 */

/**
 * The parts of an index that are read here (docs/formats/hints.md).
 * @typedef {object} Index
 * @property {{width: number, height: number, gpuTexelBytes: number, ends: number[],
 *   differences: number[], color: number[],
 *   previews?: {level: number, width: number, height: number, bytes: number, difference: number,
 *   exact?: boolean}[], probe?: object}[]} textures
 * @property {Parameters<typeof meshesOf>[0]} [meshes]
 * @property {{box: number[], recordBytes: number, geometryBytes: number}[]} cells
 */

/**
 * @param {Index} index
 * @returns {Catalogue}
 */
export function catalogueOf({ textures, cells, meshes = [] }) {
  const T = textures.length, C = cells.length;
  const levels = Int32Array.from(textures, (texture) => levelSizes(texture).length);
  const stored = Int32Array.from(textures, ({ ends }) => ends.length);
  const K = 1 + levels.reduce((most, count) => Math.max(most, count), 0);
  const [ends, memory, differences] = [0, 0, 0].map(() => new Float64Array(T * K));
  let whole = 0;
  textures.forEach((texture, t) => {
    const sizes = levelSizes(texture);
    // Coarser levels of a probe are of no use.
    const first = texture.probe ? levels[t] : 1;
    for (let k = 1; k < K; k++) {
      const at = t * K + k, size = sizes[k - 1];
      ends[at] = texture.ends[k - 1] ?? ends[at - 1];
      memory[at] = memory[at - 1] + (size ? size.width * size.height * texture.gpuTexelBytes : 0);
      differences[at] = size && k >= first ? Math.max(texture.differences[k - 1] ?? 0, LEAST_DIFFERENCE) : 0;
    }
    whole += memory[t * K + K - 1];
  });
  const previews = previewsOf(textures);
  return {
    T, C, K, levels, stored, ends, memory, differences, whole, previews,
    gains: gainsOf(differences, K, previews), meshes: meshesOf(meshes),
    colors: Float64Array.from(textures.flatMap(({ color }) => color)),
    low: Float64Array.from(cells.flatMap((cell) => cell.box.slice(0, 3))),
    high: Float64Array.from(cells.flatMap((cell) => cell.box.slice(3))),
    recordBytes: Float64Array.from(cells, ({ recordBytes }) => recordBytes),
    geometryBytes: Float64Array.from(cells, ({ geometryBytes }) => geometryBytes),
  };
}

/** @param {Index["textures"]} textures @returns {Previews} */
function previewsOf(textures) {
  const first = new Int32Array(textures.length + 1);
  textures.forEach(({ previews }, t) => (first[t + 1] = first[t] + (previews?.length ?? 0)));
  const all = textures.flatMap(({ previews }) => previews ?? []);
  return {
    first,
    column: Int32Array.from(all, ({ level }) => level + 1),
    bytes: Float64Array.from(all, ({ bytes }) => bytes),
    loss: Float64Array.from(all, ({ level, difference, exact }) =>
      exact ? 0 : Math.max(difference, LEAST_DIFFERENCE) * AVERAGING ** (level + 1)),
  };
}

/**
 * @param {Float64Array} differences (T × K)
 * @param {number} K
 * @param {Previews} previews
 */
export function gainsOf(differences, K, { first, column, loss }) {
  const T = first.length - 1, gains = new Float64Array(differences.length + column.length * K);
  gains.set(differences);
  for (let t = 0; t < T; t++) {
    for (let p = first[t]; p < first[t + 1]; p++) {
      for (let k = 1; k <= column[p]; k++) {
        // The error of the column less that of the one before it, which it replaces.
        const own = loss[p] * AVERAGING ** -k * (k > 1 ? 1 - AVERAGING : 1);
        gains[(T + p) * K + k] = differences[t * K + k] - own;
      }
    }
  }
  return gains;
}
