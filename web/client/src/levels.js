/**
 * Sizes of the levels of a texture of the index, coarsest first, texels: those of the `.ptm`, and the
 * finer ones that only previews have.
 * @param {{width: number, height: number, ends: ArrayLike<number>,
 *   previews?: {level: number, width: number, height: number}[]}} row
 */
export function levelSizes({ width, height, ends, previews }) {
  const last = previews?.at(-1), beyond = last && last.level >= ends.length ? last : null;
  const count = beyond ? beyond.level + 1 : ends.length, finest = beyond ?? { width, height };
  return Array.from({ length: count }, (_, n) => {
    const halved = count - 1 - n;
    return {
      width: Math.max(1, finest.width >> halved),
      height: Math.max(1, finest.height >> halved),
    };
  });
}

/**
 * The texels of a level as they are shown, with its offset added to the colours (docs/formats/hints.md):
 * the same array where that is 0.
 * @param {Uint8Array} texels
 * @param {number} channels 1, 2 or 4; the second and the fourth are alpha
 * @param {number} offset
 * @returns {Uint8Array}
 */
export function withOffset(texels, channels, offset) {
  if (!offset) return texels;
  const result = new Uint8ClampedArray(texels), colours = channels - +(channels > 1);
  for (let texel = 0; texel < result.length; texel += channels) {
    for (let k = texel; k < texel + colours; k++) result[k] += offset;
  }
  return new Uint8Array(result.buffer);
}
