// The script of sites with normal maps.

import { Reliefs } from "./relief/reliefs.js";

/**
 * @param {import("./walkthrough.js").Walkthrough} walk
 * @param {(fault: import("./net/errors.js").PageError) => void} report
 */
export const statuesOf = (walk, report) => new Reliefs(walk.gl, walk, report);
