// Records a walk for the simulator (docs/design/walkthrough.md): a sample of each frame, the age of the
// item buffer in it, and the requests of the page before the first.

import { clock } from "./net/fetcher.js";

/** Digits behind the point: 0.01 mm and 0.01 ms. @param {number} x */
const short = (x) => Math.round(x * 1e5) / 1e5;

export class Recorder {
  /** @type {number[][]} t, eye, direction: as samples of walks */
  #samples = [];
  /** @type {number[][]} cell, age of the item buffer, −1 for none, and s for which nothing else ran */
  #frames = [];
  #begun = -1;
  /** @type {Map<string, number[]>} when each answer was processed, by URL, s */
  #taken = new Map();

  /** @param {import("./walkthrough.js").Walkthrough} walk */
  constructor(walk) {
    this.walk = walk;
    performance.setResourceTimingBufferSize(1e5);
    const { client, stream } = walk, arrived = client.arrived.bind(client);
    client.arrived = (request, end) => {
      const url = stream.url(request.kind, request.number);
      this.#taken.set(url, [...(this.#taken.get(url) ?? []), clock()]);
      arrived(request, end);
    };
  }

  /**
   * Records a frame before it requests files.
   * @param {number} before the time at which it began, s
   * @param {import("./space/frustum.js").Frustum} frustum
   * @param {number} drawn the time at which the current item buffer was drawn, s, or −1
   */
  frame(before, { eye, direction }, drawn) {
    const now = clock();
    if (this.#begun < 0) this.#begun = now;
    this.#samples.push([now - this.#begun, ...eye, ...direction].map(short));
    const age = drawn < 0 ? -1 : now - drawn;
    this.#frames.push([this.walk.cell, age, now - before].map(short));
  }

  /** The document of the walk, with the conditions of the recording. */
  get document() {
    const { budget, client: { catalogue }, policy, viewport: { tall, aspect, lines } } = this.walk;
    return {
      format: "ptmtools walk", schema: 1, fieldOfView: tall, aspect, samples: this.#samples,
      browser: {
        begun: short(this.#begun), lines, budget: Math.round(budget), policy,
        recordBytes: Array.from(catalogue.recordBytes),
        geometryBytes: Array.from(catalogue.geometryBytes),
        files: this.#files(), frames: this.#frames, ...this.#waits(),
      },
    };
  }

  /** Files that the client did not request: time, kind, number, bytes. */
  #files() {
    const { client: { catalogue }, stream, stream: { opening, site } } = this.walk, asked = new Map([[site.address, ["index", 0]]]);
    site.index.cells.forEach((_, cell) => {
      asked.set(stream.url("record", cell), ["record", cell]);
      asked.set(stream.url("geometry", cell), ["geometry", cell]);
    });
    stream.previews.forEach((_, p) => asked.set(stream.url("preview", p), ["preview", p]));
    catalogue.meshes.forEach((_, k) => asked.set(stream.url("mesh", k), ["mesh", k]));
    const entries = [...performance.getEntriesByType("navigation"),
      ...performance.getEntriesByType("resource")];
    return /** @type {PerformanceResourceTiming[]} */ (entries)
      .filter(({ name, requestStart, transferSize }) => transferSize > 0
        && (asked.has(name) ? requestStart < 1000 * this.#begun : !/\.ptm$|\/sets\/\d/.test(name)))
      .flatMap(({ name, requestStart, encodedBodySize }) => {
        const at = short(requestStart / 1000);
        if (name !== opening?.url) return [[at, ...(asked.get(name) ?? ["page", 0]), encodedBodySize]];
        // The first levels of textures count as the page's: a file is whole, or is not there.
        const { parts } = opening;
        const size = parts.reduce((sum, [, , bytes]) => sum + bytes, 0);
        return parts.map(([kind, number, bytes]) => [at,
          ...(kind === "texture" ? ["page", 0] : [kind, number]), Math.round(bytes * encodedBodySize / size)]);
      });
  }

  /** Times between which requests waited for the browser, and answers for the page. */
  #waits() {
    /** @type {number[][]} */
    const sent = [], taken = [];
    const entries = /** @type {PerformanceResourceTiming[]} */ (
      performance.getEntriesByType("resource"));
    for (const { name, startTime, requestStart, responseEnd } of entries) {
      const at = this.#taken.get(name)?.find((at) => at >= responseEnd / 1000);
      if (!at) continue;
      if (startTime >= 1000 * this.#begun) sent.push([startTime / 1000, requestStart / 1000].map(short));
      taken.push([responseEnd / 1000, at].map(short));
    }
    return { sent, taken };
  }
}
