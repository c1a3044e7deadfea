// The part of a walk's geometry that a frustum meets.

import { distance, meetsBox } from "../space/frustum.js";

/**
 * What is drawn, the nearest cells first, and the visible cells in view without geometry.
 * @param {import("../walkthrough.js").Walkthrough} walk
 * @param {import("../space/frustum.js").Frustum} frustum
 * @returns {[import("../gl/renderer.js").Drawn[], {cell: number, box: number[]}[]]}
 */
export function inView({ catalogue: { low, high }, index, renderer, stream, visible }, frustum) {
  /** @type {import("../gl/renderer.js").Drawn[]} */
  const drawn = [];
  for (const [cell, buffers] of renderer?.cells ?? []) {
    const batches = buffers.batches.filter(({ low, high }) => meetsBox(frustum, low, high));
    if (batches.length) drawn.push({ cell, buffers, batches });
  }
  const missing = visible
    .filter((cell) => !stream.shapes.has(cell) && meetsBox(frustum, low, high, 3 * cell))
    .map((cell) => ({ cell, box: index.cells[cell].box }));
  const far = (/** @type {{cell: number}} */ { cell }) => distance(frustum.eye, low, high, 3 * cell);
  drawn.sort((a, b) => far(a) - far(b));
  return [drawn, missing];
}
