// The world of a case: cells with quads, of which those that are missing are known, but their geometry is not there.

import { Solids } from "../../web/page/walk/solids.js";

const shapeOf = (quads) => ({
  positions: new Float32Array(quads.flat(2)),
  indices: new Uint32Array(quads.flatMap((_, k) => [0, 1, 2, 0, 2, 3].map((n) => 4 * k + n))),
});

/** @param {{cell: number, box: number[], quads: number[][][], portals: any[], missing?: boolean}[]} cells */
export function worldOf(cells) {
  const solids = new Solids();
  for (const { cell, quads, portals, missing } of cells) {
    if (!missing) solids.add(cell, [shapeOf(quads)], { portals });
  }
  const holds = ([x, y, z], [a, b, c, d, e, f]) =>
    x >= a && x <= d && y >= b && y <= e && z >= c && z <= f;
  return { solids, locate: (at) => cells.find(({ box }) => holds(at, box))?.cell ?? -1 };
}
