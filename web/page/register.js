// Installs the service worker of a site that was published with `--offline`, and gives it the names of what the
// page has received: most of a first visit comes before the worker.

import { learn } from "./offline/timings.js";

const worker = navigator.serviceWorker;
/** Milliseconds between looks at the walk. */
const EVERY = 500;
/** More downloads than browsers list otherwise. */
const MOST = 10_000;

/** Files that come in ranges. */
const RANGED = /\.ptm$|\/(?!opening-)[^/]*\.bin$/;

/** @param {import("./app.js").App} app @returns {import("./offline/visits.js").Received} */
function received({ walk: { picture: { renderer }, stream, stream: { site } } }) {
  const files = performance.getEntriesByType("resource").map(({ name }) => name.split("#")[0]);
  const textures = stream.files.map(({ length }, t) => ({ url: stream.url("texture", t), length }));
  const levels = renderer.statues?.levels ?? [], { octrees = [] } = site.index;
  const objects = octrees.map(({ file, ends }, k) => ({ url: site.of(file), length: ends[levels[k] - 1] ?? 0 }));
  const ranged = [...textures, ...objects].filter(({ url, length }) => length > 0 && RANGED.test(url));
  return { index: site.address, files: files.filter((name) => !RANGED.test(name)), ranged };
}

// Browsers have none without https.
if (worker) {
  performance.setResourceTimingBufferSize(MOST);
  worker.register("offline.js").catch(() => {});
  const appOf = () => /** @type {import("./app.js").App | undefined} */ (Reflect.get(window, "ptm"));
  /** @type {import("./offline/timings.js").Timing[]} */
  const early = [];
  let before = 0;
  const known = new Set();
  worker.onmessage = ({ data }) => {
    for (const timing of data) {
      const key = `${timing.asked} ${timing.ended}`;
      if (!known.has(key)) early.push(timing);
      known.add(key);
    }
    const app = appOf();
    if (app) learn(app.walk.stream.estimate, early.splice(0));
  };
  worker.controller?.postMessage({ since: performance.timeOrigin });
  // Once at the first picture, and once everything is there.
  const timer = setInterval(() => {
    const app = appOf();
    if (!worker.controller || !app?.walk.begun) return;
    const now = app.walk.complete ? 2 : 1;
    if (now > before) worker.controller.postMessage(received(app));
    before = now;
    if (now === 2) clearInterval(timer);
  }, EVERY);
}
