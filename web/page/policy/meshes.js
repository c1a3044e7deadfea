// Levels of detail of objects: the GLB of a cell has the coarsest mesh of an object with many triangles,
// and files of their own the finer ones (docs/formats/client.md).

import { BEHIND, GROSS, NEAREST, NOTHING, SEEN } from "./constants.js";
import { distance, meetsBox } from "../space/frustum.js";

/**
 * The file of a finer mesh.
 * @typedef {object} FinerMesh
 * @property {number} mesh place of the object in the index
 * @property {number} cell
 * @property {string} file
 * @property {number} bytes
 * @property {number[]} low corner of the object's box
 * @property {number[]} high
 * @property {number} error metres, and that of the mesh in the GLB of the cell
 * @property {number} coarsest
 *
 * @typedef {import("./client.js").Client} Client
 */

/** The worth of an error by distance, as a share of that. @param {number} error */
const worth = (error) => error / (error + GROSS);

/**
 * The files of finer meshes of an index.
 * @param {{cell: number, box: number[], errors: number[], files: string[], bytes?: number[]}[]} rows
 * @returns {FinerMesh[]}
 */
export const meshesOf = (rows) =>
  rows.flatMap(({ cell, box, errors, files, bytes }, mesh) => files.map((file, k) => ({
    mesh, cell, file, bytes: bytes?.[k] ?? 0, low: box.slice(0, 3), high: box.slice(3),
    error: errors[k + 1], coarsest: errors[0],
  })));

/**
 * For each file the gain by it beside those that are `there`.
 * @param {Client} client
 * @param {(file: number) => boolean} there
 * @returns {number[]} 0 where none can be seen
 */
export function gainsOf({ catalogue: { meshes }, known, cell, frustum, downloads }, there) {
  /** @type {number[]} */
  const least = [];
  meshes.forEach(({ mesh, error, coarsest }, k) =>
    (least[mesh] = Math.min(least[mesh] ?? coarsest, there(k) ? error : Infinity)));
  return meshes.map(({ mesh, cell: c, low, high, error }) => {
    const far = frustum ? Math.max(distance(frustum.eye, low, high), NEAREST) : 0;
    const now = least[mesh] / far;
    if (!frustum || !(now > SEEN) || !known[cell]?.visible.includes(c)
      || !downloads.has("geometry", c)) return 0;
    const size = Math.hypot(...high.map((x, i) => x - low[i])) / 2;
    const share = Math.min(1, (size / far) ** 2) * (meetsBox(frustum, low, high) ? 1 : BEHIND);
    return NOTHING * share * Math.max(worth(now) - worth(error / far), 0);
  });
}
