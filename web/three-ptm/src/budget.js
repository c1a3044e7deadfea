// Distributes texture memory by coverage of the view.

/** Bytes of a texel on the GPU, whatever its components. */
export const TEXEL_BYTES = 4;

/**
 * A texture in view.
 * @typedef {object} Want
 * @property {{width: number, height: number}[]} sizes of its levels, coarsest first
 * @property {number} share of the view, or anything in proportion to it
 * @property {number} copies textures of three.js that show it, one for each way to wrap
 */

/**
 * Texture memory of the levels up to one.
 * @param {{width: number, height: number}[]} sizes
 * @param {number} level
 */
export function pyramidBytes(sizes, level) {
  const texels = sizes.slice(0, level + 1).reduce((sum, one) => sum + one.width * one.height, 0);
  return TEXEL_BYTES * texels;
}

/**
 * The level that each texture may have: the finest that fits into its part of the memory, at least
 * the coarsest. Unused parts go to the others. One of them may
 * be in memory twice while its storage is exchanged.
 * @param {Want[]} wants
 * @param {number} gpuBytes
 * @returns {number[]} aligned with `wants`
 */
export function shareOut(wants, gpuBytes) {
  const first = fill(wants, gpuBytes);
  const twice = wants.map(({ sizes }, n) => pyramidBytes(sizes, Math.max(first[n] - 1, 0)));
  return fill(wants, gpuBytes - Math.max(...twice, 0));
}

/**
 * @param {Want[]} wants
 * @param {number} gpuBytes
 */
function fill(wants, gpuBytes) {
  /** @param {Want} want */
  const all = ({ sizes, copies }) => copies * pyramidBytes(sizes, sizes.length - 1);
  const levels = new Array(wants.length).fill(0);
  let left = gpuBytes;
  let shares = wants.reduce((sum, { share }) => sum + share, 0);
  // Textures that need least for their share come first: the rest goes to the others.
  const order = [...wants.keys()].sort(
    (a, b) => all(wants[a]) / wants[a].share - all(wants[b]) / wants[b].share,
  );
  for (const n of order) {
    const { sizes, share, copies } = wants[n];
    const part = (left * share) / shares;
    while (levels[n] + 1 < sizes.length && copies * pyramidBytes(sizes, levels[n] + 1) <= part) {
      levels[n]++;
    }
    left -= copies * pyramidBytes(sizes, levels[n]);
    shares -= share;
  }
  return levels;
}
