// The requests of a page for an opening, by the lines of its screen, and the columns that it expects in view;
// with a second argument, of a visitor who begins elsewhere.

import { Stream } from "../../web/page/stream.js";

const lines = Number(process.argv[2]), asked = [];
const preview = (level, n) => ({ file: `${level}-${n}.webp`, level, bytes: 1, width: 1, height: 1, difference: 1 });
const texture = { file: "t.ptm", ends: [1], width: 8, height: 8, components: 3, previews: [1, 2, 3].map(preview) };
const index = { textures: [texture, { ...texture, previews: [preview(3, "other")] }], cells: [] };
globalThis.document = { hidden: false };
const downloads = {
  free: () => true,
  ask: (kind, number, priority) => (asked.push([kind, number, priority]), { kind, number, priority }),
};
const stream = new Stream({
  site: { index, of: (file) => file, texture: (t) => `${t}`, cell: () => "" },
  index,
  client: { catalogue: { T: 2, K: 5 }, downloads, next: () => null, arrived: () => {}, failed: () => {} },
  locator: {},
  estimate: { concurrency: 100 },
  fetcher: { requests: 0, bytes: 0, whole: async () => new Uint8Array(1) },
  opening: {
    parts: [["preview", 0, 1]], take: async () => null,
    next: Promise.resolve(process.argv.length < 4 ? [[3, 700], [1, 300], [2, 600]] : null),
  },
  decoders: { workers: {}, geometry: async () => null },
  report: (fault) => { throw fault; },
});
const present = await stream.follow({ angle: 1, across: () => lines });
await new Promise((done) => setImmediate(done));
console.log(JSON.stringify({ asked, present: present ? [...present] : null }));
