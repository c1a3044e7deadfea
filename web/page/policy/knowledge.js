// The data of a cell that policies use, from its record and its geometry.

/**
 * The parts of a record that are read here (docs/formats/hints.md).
 * @typedef {object} CellRecord
 * @property {number[]} adjacent
 * @property {number[]} visible
 * @property {number[]} ach
 * @property {number} floor
 * @property {number[][]} textures
 * @property {number[][]} [need]
 * @property {{points: number[][], faces: number[][]}[]} leaves
 * @property {{neighbour: number, polygon: number[][]}[]} portals
 */

/**
 * The contents of a record.
 * @typedef {object} Known
 * @property {number[]} adjacent cells beyond its portals
 * @property {number[]} visible cells that it may see, itself first
 * @property {Float64Array} coverage of each of these; none is 0
 * @property {number[]} textures of all that it may see
 * @property {number[][] | undefined} need see docs/formats/hints.md
 * @property {Float64Array} hull points of its leaves, x, y, z of each
 * @property {CellRecord["portals"]} portals
 */

/**
 * The shapes of a cell that have a texture, once more those that have a lightmap, and a probe.
 * @typedef {{textures: Int32Array, boxes: Float64Array}} Shapes which texture; the low and the high
 *   corner of each, six numbers, metres
 */

/**
 * @param {CellRecord} record
 * @returns {Known}
 */
export function knownOf({ adjacent, visible, ach, floor, textures, need, leaves, portals }) {
  return {
    adjacent, visible, need, portals,
    coverage: Float64Array.from(ach, (share) => Math.max(share, floor)),
    textures: [...new Set(textures.flat())],
    hull: Float64Array.from(leaves.flatMap((leaf) => leaf.points.flat())),
  };
}

/**
 * @param {{texture: number, light?: number, probe?: number, low: number[], high: number[]}[]} all
 * @returns {Shapes}
 */
export function shapesOf(all) {
  const shapes = all.flatMap((shape) =>
    [shape.texture, shape.light ?? -1, shape.probe ?? -1].map((texture) => ({ ...shape, texture })))
    .filter((shape) => shape.texture >= 0);
  return {
    textures: Int32Array.from(shapes, (shape) => shape.texture),
    boxes: Float64Array.from(shapes.flatMap((shape) => [...shape.low, ...shape.high])),
  };
}
