// The script of sites with normal maps.

import { loadStatues } from "./load-later.js";
import { Reliefs } from "./relief/reliefs.js";

/** @typedef {NonNullable<import("./gl/renderer.js").Renderer["statues"]>} Drawer */

/**
 * @param {import("./walkthrough.js").Walkthrough} walk
 * @param {(fault: import("./net/errors.js").PageError) => void} report
 * @returns {Promise<Drawer>}
 */
export async function statuesOf(walk, report) {
  const reliefs = new Reliefs(walk.gl, walk, report);
  if (!walk.index.octrees) return reliefs;
  const { statuesOf: octreesOf } = await loadStatues();
  return both(octreesOf(walk, report), reliefs);
}

/**
 * Objects with octrees, and other surfaces with normal maps.
 * @param {import("./octree/statues.js").Statues} octrees
 * @param {Reliefs} reliefs
 * @returns {Drawer}
 */
function both(octrees, reliefs) {
  return {
    delete() {
      octrees.delete();
      reliefs.delete();
    },
    has: (look) => octrees.has(look) || reliefs.has(look),
    get lacks() {
      return octrees.lacks || reliefs.lacks;
    },
    get levels() {
      return octrees.levels;
    },
    get bytes() {
      return octrees.bytes;
    },
    advance(drawn, eye, lines, loads) {
      octrees.advance(drawn, eye, lines, loads);
      reliefs.advance(drawn, eye, lines);
    },
    draw(camera, batches, paint, now) {
      const has = (/** @type {typeof batches[0]} */ { batch }) => octrees.has(batch.look);
      const first = octrees.draw(camera, batches.filter(has), paint);
      return reliefs.draw(camera, batches.filter((each) => !has(each)), paint, now) || first;
    },
  };
}
