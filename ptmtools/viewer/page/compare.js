// What the view would be with every level: a second texture memory, for as long as somebody looks at
// both, and halves of the picture drawn from one and the other.

import { Renderer } from "./gl/renderer.js";
import { TextureMemory } from "./gl/texture-memory.js";
import { room } from "./policy/best.js";

/** A request takes so many seconds of the link, and at least so many bytes, lest the walk wait for it. */
const RANGE_SECONDS = 0.2, RANGE = 65536;

export class Comparison {
  /** @param {import("./walkthrough.js").Walkthrough} walk */
  constructor(walk) {
    const { gl, rows, stream, means } = walk;
    this.walk = walk;
    this.memory = new TextureMemory(gl, rows, (t, levels) => stream.decode(t, levels));
    this.memory.fades = false;
    this.renderer = new Renderer(gl, this.memory, means);
  }

  /** Asks for what the view shows, to the finest level that it can resolve; true once it is there. */
  settle() {
    const { walk, memory } = this, { client, catalogue, present, estimate } = walk;
    const { T, K, levels, ends } = catalogue;
    if (!present) return false;
    const want = new Int32Array(T), share = new Float64Array(T);
    let whole = true;
    for (let t = 0; t < T; t++) {
      share[t] = present[t * K + 1];
      let column = levels[t];
      while (column > 0 && !(present[t * K + column] > 0)) column--;
      want[t] = Math.min(column, client.have[t]);
      whole &&= want[t] === column && memory.held[t] >= column;
      const { downloads } = client;
      if (column > client.have[t] && downloads.free("texture", t) && room(estimate, downloads.waiting)) {
        const most = downloads.bytes[t] + Math.max(RANGE, RANGE_SECONDS * estimate.bandwidth / 8);
        const end = Math.min(ends[t * K + column], Math.floor(most));
        walk.stream.ask(downloads.ask("texture", t, share[t], end));
      }
    }
    memory.settle(want, share);
    return whole;
  }

  /** Gives all of it back. */
  delete() {
    this.memory.delete();
    this.renderer.delete();
  }
}
