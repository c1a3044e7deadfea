// The tiles of a level (docs/formats/ptm.md, "Groups and tiles").

/**
 * Tiles across and down.
 * @param {number} width
 * @param {number} height
 * @param {number} side 0 never cuts
 */
export function tileCounts(width, height, side) {
  if (!side || Math.max(width, height) <= 2 * side) return [1, 1];
  return [Math.max(1, Math.floor(width / side)), Math.max(1, Math.floor(height / side))];
}

/**
 * The begin of a tile along one side, and its size: the last takes the rest.
 * @param {number} i its number along that side
 * @param {number} count of the tiles
 * @param {number} side
 * @param {number} size of the level
 */
export function tileSpan(i, count, side, size) {
  const begin = count > 1 ? i * side : 0;
  return [begin, (i === count - 1 ? size : begin + side) - begin];
}
