// The script of sites with normal maps.

import { loadStatues } from "./load-later.js";
import { Reliefs } from "./relief/reliefs.js";

/** @typedef {NonNullable<import("./gl/renderer.js").Renderer["statues"]>} Drawer */

/**
 * Lets the renderer draw them, and octrees if there are any.
 * @param {import("./walkthrough.js").Walkthrough} walk
 */
export async function show(walk) {
  if (walk.index.octrees) (await loadStatues()).show(walk);
  const { picture: { renderer } } = walk, reliefs = new Reliefs(walk);
  const { statues } = renderer;
  renderer.statues = statues ? both(statues, reliefs) : reliefs;
}

/**
 * Objects with octrees, and other surfaces with normal maps.
 * @param {Drawer} octrees
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
      const first = octrees.draw(camera, batches.filter(has), paint, now);
      return reliefs.draw(camera, batches.filter((each) => !has(each)), paint, now) || first;
    },
  };
}
