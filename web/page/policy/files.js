// Documents, geometry and objects of the visible set, as clients without a measure of worth fetch them.

import { meetsBox } from "../space/frustum.js";

/** @typedef {import("./client.js").Client} Client */
/** @typedef {import("./downloads.js").Kind} Kind */

/** Whether the box of a cell meets the frustum. @param {Client} client @param {number} c */
export const boxed = ({ catalogue, frustum }, c) =>
  !!frustum && meetsBox(frustum, catalogue.low, catalogue.high, 3 * c);

/**
 * The files that have objects of visible cells with geometry as modelled: such clients have no others.
 * @param {Client} client
 */
export function modelled({ catalogue: { meshes }, cell, known, downloads }) {
  return [...meshes.keys()].filter((k) => meshes[k + 1]?.mesh !== meshes[k].mesh
    && known[cell]?.visible.includes(meshes[k].cell) && downloads.has("geometry", meshes[k].cell));
}

/**
 * Number of counted records, geometry and objects in view that are missing.
 * @param {Client} client
 * @param {(kind: Kind, number: number) => boolean} counts
 */
export function lacking(client, counts) {
  const { cell, here, known, downloads } = client;
  let count = downloads.has("record", here) || !counts("record", here) ? 0 : 1;
  for (const c of known[cell]?.visible ?? []) {
    const seen = c === cell || boxed(client, c);
    if (seen && !downloads.has("geometry", c) && counts("geometry", c)) count++;
  }
  for (const k of modelled(client)) if (!downloads.has("mesh", k) && counts("mesh", k)) count++;
  return count;
}
