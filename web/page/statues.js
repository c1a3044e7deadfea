// The script of sites with octree textures.

import { Statues } from "./octree/statues.js";
import { weighLevels } from "./octree/weighing.js";

/**
 * Lets the renderer draw them.
 * @param {import("./walkthrough.js").Walkthrough} walk
 * @param {(fault: import("./net/errors.js").PageError) => void} report
 */
export function show(walk, report) {
  const { gl, index, site, fetcher, renderer } = walk;
  if (!renderer) return;
  const statues = new Statues(gl, index.octrees ?? [], site, fetcher, report, () => walk.touch());
  renderer.statues = statues;
  if (new URLSearchParams(location.search).get("octrees") === "best") weighLevels(walk, statues);
}
