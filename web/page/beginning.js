// Progress until the first picture: the room, then the coarse levels of its visible textures.

/** Levels of a texture that make a first picture. */
const FIRST_LEVELS = 5;

/** @param {import("./walkthrough.js").Walkthrough} walk */
export function beginningOf(walk) {
  const { catalogue: { T, K, levels }, client, memory, present, stream } = walk;
  const parts = +stream.records.has(walk.cell) + +stream.shapes.has(walk.cell);
  let loaded = parts, total = 2;
  for (let t = 0; t < T; t++) {
    const seen = present && present[t * K + 1] > 0 && !client.downloads.rests("texture", t);
    const wanted = seen ? Math.min(FIRST_LEVELS, levels[t]) : 0;
    total += wanted;
    loaded += Math.min(memory.held[t], wanted);
  }
  const room = parts < 2 || total === 2;
  return {
    progress: { stage: room ? "Loading the room" : "Loading textures", loaded, total: room ? 12 : total },
    // Without the room there is no picture.
    over: parts === 2 && ((!room && loaded >= total) || walk.complete),
  };
}
