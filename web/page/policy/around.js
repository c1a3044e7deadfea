// The surroundings of the eye as shares of pixels, by texture and column, and the worth of the geometry
// of cells.

import { distance } from "../space/frustum.js";
import { BEHIND, BEYOND, NEAREST, NOTHING } from "./constants.js";

/** @typedef {import("./client.js").Client} Client */

/**
 * (T) shares that fall with the square of the distance of the nearest shape; they sum to 1.
 * @param {Client} client
 */
function byDistance({ catalogue, shapes, frustum }) {
  const share = new Float64Array(catalogue.T), eye = frustum?.eye ?? [0, 0, 0];
  for (const some of shapes) {
    if (!some) continue;
    const { textures, boxes } = some;
    for (let s = 0; s < textures.length; s++) {
      const far = Math.max(distance(eye, boxes, boxes, 6 * s, 6 * s + 3), NEAREST);
      const near = 1 / (far * far);
      if (near > share[textures[s]]) share[textures[s]] = near;
    }
  }
  const total = Math.max(share.reduce((sum, each) => sum + each, 0), 1e-12);
  return share.map((each) => each / total);
}

/**
 * Writes to `around` (T × K) the mean of the shares by distance and of the needs in the record of the
 * cell; the shares by distance alone, if the record has no needs.
 * @param {Client} client
 * @param {Float64Array} around
 */
export function lookAround(client, around) {
  // Records may list levels that the GPU cannot hold and the catalogue omits.
  const { T, K, levels } = client.catalogue;
  const near = byDistance(client), need = client.known[client.cell]?.need;
  around.fill(0);
  for (const [texture, first, ...shares] of need ?? []) {
    const at = texture * K + 1;
    around.fill(shares[0], at, at + Math.min(first, levels[texture]));
    around.set(shares.slice(0, Math.max(levels[texture] - first, 0)), at + Math.min(first, K - 1));
  }
  for (let t = 0; t < T; t++) {
    for (let k = 1, at = t * K + 1; k <= levels[t]; k++, at++) {
      around[at] = need ? (near[t] + around[at]) / 2 : near[t];
    }
  }
}

/**
 * Writes to `worth` (C) the gain by the geometry of each cell: from the share of the item buffer that
 * shows its placeholder, and from its average coverage.
 * @param {Client} client
 * @param {Float64Array} worth
 */
export function weighGeometry({ known, cell, hidden, left }, worth) {
  const here = known[cell];
  worth.fill(0);
  if (!here) return;
  here.visible.forEach((c, i) => (worth[c] = BEHIND * here.coverage[i]));
  for (const neighbour of here.adjacent) {
    const next = known[neighbour];
    next?.visible.forEach((c, i) => {
      // Forgotten geometry is not fetched again for a view from elsewhere.
      if (!left[c]) worth[c] = Math.max(worth[c], BEYOND * next.coverage[i]);
    });
  }
  for (let c = 0; c < worth.length; c++) worth[c] = NOTHING * (worth[c] + hidden[c]);
}
