// The components of a texel in coding order, and what texels outside the blocks are predicted from.

/**
 * Component of each plane.
 * @param {number} components
 */
export function planeOrder(components) {
  return components > 2 ? [1, 0, 2, 3].slice(0, components) : [0, 1].slice(0, components);
}

/**
 * How many of the planes coded first a plane refers to.
 * @param {number} components
 * @param {number} plane
 */
export function references(components, plane) {
  return components > 2 && plane < 3 ? plane : 0;
}

/**
 * @param {number} a
 * @param {number} b
 * @param {number} corner between them
 */
export function median(a, b, corner) {
  const low = a < b ? a : b;
  const high = a < b ? b : a;
  const across = a + b - corner;
  return across < low ? low : across > high ? high : across;
}

/**
 * Places of the texels that belong to no block, in order: the odd last column, the odd last row.
 * @param {number} width
 * @param {number} height
 */
export function edgePlaces(width, height) {
  const places = [];
  if (width & 1) for (let y = 0; y < (height & ~1); y++) places.push(y * width + width - 1);
  if (height & 1) for (let x = 0; x < width; x++) places.push((height - 1) * width + x);
  return places;
}
