// Progress until the first picture: the room, then the coarse levels of its visible textures.

import { page } from "./words/english.js";

/** Share of the pixels that need them; what few others show may come much later. */
const ENOUGH = 0.95;
/** Steps of the progress that textures make; the room makes two. */
const STEPS = 10;

/** @param {import("./walkthrough.js").Walkthrough} walk */
export function beginningOf(walk) {
  const { client, client: { catalogue: { T, K, levels } }, memory, needs: { expected, present }, stream } = walk;
  const parts = +stream.records.has(walk.cell) + +stream.shapes.has(walk.cell);
  let share = 0, total = 0;
  for (let t = 0; t < T; t++) {
    const seen = present?.[t * K + 1];
    if (!seen || client.downloads.rests("texture", t)) continue;
    const wanted = Math.min(walk.firstLevels, levels[t]);
    total += seen;
    share += seen * Math.min(memory.held[t] / wanted, 1);
  }
  const room = parts < 2 || total === 0;
  return {
    progress: {
      stage: room ? page.room : page.textures,
      loaded: parts + (room ? 0 : STEPS * share / total),
      total: 2 + STEPS,
    },
    // Without the room there is no picture; an item buffer says that it has been drawn.
    over: parts === 2 && !expected && ((!room && share >= ENOUGH * total) || walk.has(false)),
  };
}
