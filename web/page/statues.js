// The script of sites with octree textures.

import { Statues } from "./octree/statues.js";

/**
 * @param {import("./walkthrough.js").Walkthrough} walk
 * @param {(fault: import("./net/errors.js").PageError) => void} report
 */
export const statuesOf = (walk, report) =>
  new Statues(walk.gl, walk.index.octrees ?? [], walk.site, walk.fetcher, report, () => walk.touch());
