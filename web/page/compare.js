// The comparison with full resolution: a second texture memory with every level that the view can
// resolve, from which the right half of the picture is drawn.

import { Renderer } from "./gl/renderer.js";
import { TextureMemory } from "./gl/texture-memory.js";
import { room } from "./policy/best.js";
import { RANGE_BYTES, RANGE_SECONDS } from "./policy/constants.js";

export class Comparison {
  /** @param {import("./walkthrough.js").Walkthrough} walk */
  constructor(walk) {
    const { gl, rows, stream, index } = walk;
    this.walk = walk;
    this.memory = new TextureMemory(gl, rows, (t, levels) => stream.decode(t, levels));
    this.memory.fades = false;
    this.renderer = new Renderer(gl, this.memory, index.textures);
    const { light, statues } = walk.picture.renderer;
    light?.illuminate(this.renderer);
    this.renderer.statues = statues;
  }

  /** Requests the visible textures to the finest level that the view resolves; true once all are here. */
  settle() {
    const { walk, memory } = this, { client, client: { catalogue }, needs: { present }, stream: { estimate } } = walk;
    const { T, K, levels, stored, ends, previews: { first, column, loss } } = catalogue;
    if (!present) return false;
    const want = new Int32Array(T), share = new Float64Array(T), losses = new Float64Array(T);
    const { downloads } = client, most = Math.max(RANGE_BYTES, RANGE_SECONDS * estimate.bandwidth / 8);
    /** @type {{texture: number, end: number, preview: number}[]} */
    const missing = [];
    for (let t = 0; t < T; t++) {
      share[t] = present[t * K + 1];
      let k = levels[t], preview = -1;
      while (k > 0 && !(present[t * K + k] > 0)) k--;
      want[t] = Math.min(k, downloads.reach(t).last);
      losses[t] = downloads.loss(t, want[t]);
      // Levels that the `.ptm` lacks come from the closest preview.
      for (let p = first[t]; k > stored[t] && p < first[t + 1]; p++) {
        if (column[p] >= k && (preview < 0 || loss[p] < loss[preview])) preview = p;
      }
      const least = preview < 0 ? 0 : loss[preview];
      if (memory.held[t] < k || (k > 0 && memory.loss[t] > least)) {
        missing.push({ texture: t, end: ends[t * K + k], preview });
      }
    }
    memory.settle(want, share, losses);
    missing.sort((a, b) => share[b.texture] - share[a.texture]);
    for (const { texture, end, preview } of missing) {
      if (!room(estimate, downloads.waiting)) break;
      if (preview >= 0) {
        if (downloads.free("preview", preview)) {
          walk.stream.ask(downloads.ask("preview", preview, share[texture]));
        }
        continue;
      }
      const part = Math.min(end, Math.floor(downloads.bytes[texture] + most));
      if (part <= downloads.bytes[texture] || !downloads.free("texture", texture)) continue;
      walk.stream.ask(downloads.ask("texture", texture, share[texture], part));
    }
    return missing.length === 0;
  }

  /** Frees all of it. */
  delete() {
    this.memory.delete();
    this.renderer.delete();
  }
}
