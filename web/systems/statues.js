// The script of sites with octree textures.

import { Statues } from "./octree/statues.js";
import { weighLevels } from "./octree/weighing.js";

/**
 * Lets the renderer draw them.
 * @param {import("../page/walkthrough.js").Walkthrough} walk
 */
export function show(walk) {
  const { gl, index, picture, picture: { renderer }, stream: { site, fetcher } } = walk;
  const touch = () => picture.touch();
  const statues = new Statues(gl, index.octrees ?? [], site, fetcher, walk.report, touch, renderer);
  renderer.statues = statues;
  if (new URLSearchParams(location.search).get("octrees") === "best") weighLevels(walk, statues);
}
