// The worth of normal maps of materials.

import { NORMALS } from "../policy/constants.js";

/**
 * Lowers the gains of normal maps, once: until then nothing wants them.
 * @param {import("../policy/catalogue.js").Catalogue} catalogue
 * @param {{normals?: boolean}[]} textures
 */
export function weigh(catalogue, textures) {
  const { T, K, gains, previews: { first } } = catalogue;
  if (weighed.has(gains)) return;
  weighed.add(gains);
  for (let t = 0; t < T; t++) {
    if (!textures[t].normals) continue;
    for (const [row, end] of [[t, t + 1], [T + first[t], T + first[t + 1]]]) {
      for (let at = row * K; at < end * K; at++) gains[at] *= NORMALS;
    }
  }
}

/** A lost context makes the drawing again, but not the catalogue. @type {WeakSet<Float64Array>} */
const weighed = new WeakSet();
