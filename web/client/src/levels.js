/**
 * Sizes of the levels of a texture of the index, coarsest first, texels.
 * @param {{width: number, height: number, ends: ArrayLike<number>}} row
 */
export function levelSizes({ width, height, ends }) {
  return Array.from(ends, (_, n) => {
    const halved = ends.length - 1 - n;
    return { width: width >> halved, height: height >> halved };
  });
}
