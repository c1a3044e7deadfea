// The script of sites with octree textures.

export { Statues } from "./octree/statues.js";
