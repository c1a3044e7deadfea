// Sizes of everything that can be fetched, as arrays from the index. A texture holds column k if it has
// the levels 0 to k − 1; column 0 is nothing. Tables of T textures and K columns are flat, texture by
// texture; after a texture's last column they repeat it.

/**
 * @typedef {object} Catalogue
 * @property {number} T textures
 * @property {number} C cells
 * @property {number} K columns, that of nothing included
 * @property {Int32Array} levels (T) of each texture
 * @property {Float64Array} ends (T × K) bytes of the file that hold each column
 * @property {Float64Array} memory (T × K) bytes of texture memory that each column takes
 * @property {Float64Array} differences (T × K) of each column to the one before it, 0 to 255; of
 *   columns after the last 0
 * @property {Float64Array} colors (T × 3) mean colour, 0 to 255
 * @property {Float64Array} low (C × 3) corner of the box of each cell, metres
 * @property {Float64Array} high (C × 3)
 * @property {Float64Array} recordBytes (C) on the link
 * @property {Float64Array} geometryBytes (C)
 * @property {number} whole bytes of texture memory that all textures take
 */

/**
 * The parts of an index that are read here (docs/formats/hints.md).
 * @typedef {object} Index
 * @property {{width: number, height: number, components: number, texelBytes: number,
 *   gpuTexelBytes?: number, ends: number[], differences?: number[], color?: number[]}[]} textures
 * @property {{box: number[], recordBytes?: number, geometryBytes?: number}[]} cells
 */

// A level that only repeats the texels of the one below still sharpens interpolated colours.
const LEAST = 0.5;
const RECORD_BYTES = 1000, GEOMETRY_BYTES = 4000;
const GREY = [128, 128, 128];

/**
 * @param {Index} index
 * @returns {Catalogue}
 */
export function catalogueOf({ textures, cells }) {
  const T = textures.length, C = cells.length;
  const levels = Int32Array.from(textures, (texture) => texture.ends.length);
  const K = 1 + levels.reduce((most, count) => Math.max(most, count), 0);
  const [ends, memory, differences] = [0, 0, 0].map(() => new Float64Array(T * K));
  let whole = 0;
  textures.forEach((texture, t) => {
    const { width, height, components, texelBytes } = texture;
    const stored = components === 3 ? (texelBytes / 3) * 4 : texelBytes;
    for (let k = 1; k < K; k++) {
      const at = t * K + k, shift = levels[t] - k;
      const texels = Math.max(1, width >> shift) * Math.max(1, height >> shift);
      const exists = k <= levels[t];
      ends[at] = exists ? texture.ends[k - 1] : ends[at - 1];
      memory[at] = memory[at - 1] + (exists ? texels * (texture.gpuTexelBytes ?? stored) : 0);
      differences[at] = exists ? Math.max(texture.differences?.[k - 1] ?? 0, LEAST) : 0;
    }
    whole += memory[t * K + K - 1];
  });
  return {
    T, C, K, levels, ends, memory, differences, whole,
    colors: Float64Array.from(textures.flatMap((texture) => texture.color ?? GREY)),
    low: Float64Array.from(cells.flatMap((cell) => cell.box.slice(0, 3))),
    high: Float64Array.from(cells.flatMap((cell) => cell.box.slice(3))),
    recordBytes: Float64Array.from(cells, (cell) => cell.recordBytes ?? RECORD_BYTES),
    geometryBytes: Float64Array.from(cells, (cell) => cell.geometryBytes ?? GEOMETRY_BYTES),
  };
}
