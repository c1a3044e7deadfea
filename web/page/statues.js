// The script of sites with octree textures.

import { Statues } from "./octree/statues.js";

/**
 * Lets the renderer draw them.
 * @param {import("./walkthrough.js").Walkthrough} walk
 * @param {(fault: import("./net/errors.js").PageError) => void} report
 */
export function show(walk, report) {
  const { gl, index, site, fetcher, renderer } = walk;
  if (renderer) renderer.statues = new Statues(gl, index.octrees ?? [], site, fetcher, report, () => walk.touch());
}
