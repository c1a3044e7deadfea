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
