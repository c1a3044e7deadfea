// `?memory=auto`: the budget of texture memory, measured in the browser of the visitor.

import { frame, Load } from "./gl/load.js";
import { largestBudget } from "./policy/budget.js";
import { panels } from "./words/english.js";

/** Seconds of a frame at 30 a second; the least budget, bytes; pictures whose fastest counts. */
const LONGEST = 1 / 30, LEAST = 4 << 20, PICTURES = 12;
/** Times the default budget that is tried at most: more could take the memory of other programs. */
const MOST = 4;

/**
 * @typedef {object} Measured
 * @property {number} bytes the largest budget that keeps 30 pictures a second; 0 if none does
 * @property {number} picture s of a picture of the walk
 * @property {[number, number][]} tried bytes of textures, and s of drawing from each of them
 */

/**
 * Sets the budget to the largest one that keeps 30 pictures a second: those of the walk, and drawing
 * once from each texture of the budget. Without such a budget, the default stays.
 * @param {import("./app.js").App} app
 * @returns {Promise<Measured | null>} null, with a notice, if it fails
 */
export async function measureBudget(app) {
  const { walk } = app, { T, K, memory, whole } = walk.client.catalogue;
  let picture = Infinity;
  for (let k = 0; k < PICTURES; k++) {
    walk.picture.touch();
    await frame();
    picture = Math.min(picture, walk.picture.fence.took || Infinity);
  }
  // While a texture is replaced, it is there twice.
  let largest = 0;
  for (let t = 0; t < T; t++) largest = Math.max(largest, memory[t * K + K - 1]);
  const most = Math.min(MOST * walk.budget, whole + largest);
  /** @type {Measured["tried"]} */
  const tried = [];
  const load = new Load();
  try {
    const bytes = await largestBudget(LEAST, most, LONGEST - picture, async (bytes) => {
      const seconds = await load.seconds(bytes);
      tried.push([bytes, seconds]);
      return seconds;
    });
    if (bytes) app.setBudget(bytes);
    else app.emit("notice", { message: panels.noBudget });
    return { bytes, picture, tried };
  } catch {
    app.emit("notice", { message: panels.unmeasured });
    return null;
  } finally {
    load.delete();
  }
}
