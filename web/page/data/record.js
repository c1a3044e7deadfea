// Reads and validates the record of a cell (docs/formats/hints.md): a damaged file may still be JSON.

/** @typedef {import("./site.js").CellRecord} CellRecord */

/** @param {unknown} list @param {(item: any) => boolean} holds @param {number} [least] how many */
const each = (list, holds, least = 0) =>
  Array.isArray(list) && list.length >= least && list.every(holds);

/** Tests whether a number is an index below a count. @param {number} count */
const below = (count) => (/** @type {unknown} */ n) =>
  Number.isInteger(n) && /** @type {number} */ (n) >= 0 && /** @type {number} */ (n) < count;

/** @param {any} point */
const isPoint = (point) => each(point, Number.isFinite, 3);

/**
 * The record of a cell. Throws an Error if it is not valid.
 * @param {Uint8Array} body
 * @param {number} cell
 * @param {number} cells in the index
 * @param {number} textures
 * @returns {CellRecord}
 */
export function readRecord(body, cell, cells, textures) {
  const record = JSON.parse(new TextDecoder().decode(body));
  if (record.cell !== cell) throw new Error("is of another cell");
  const isCell = below(cells), isTexture = below(textures);
  const whole = each(record.visible, isCell, 1)
    && each(record.adjacent, isCell)
    && each(record.ach, Number.isFinite, record.visible.length)
    && Number.isFinite(record.floor)
    && each(record.textures, (row) => each(row, isTexture))
    && each(record.need ?? [], (row) => each(row, Number.isFinite, 3) && isTexture(row[0]) && row[1] >= 0)
    && each(record.leaves, ({ points, faces }) =>
      each(points, isPoint, 1) && each(faces, (face) => each(face, below(points.length), 3)))
    && each(record.portals, ({ neighbour, polygon }) => isCell(neighbour) && each(polygon, isPoint, 3));
  if (!whole) throw new Error("is not the record of a cell");
  return record;
}
