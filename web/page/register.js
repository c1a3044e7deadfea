// Installs the service worker of a site that was published with `--offline`, and gives it the names of what the
// page has received: most of a first visit comes before the worker.

const worker = navigator.serviceWorker;
/** Milliseconds between looks at the walk. */
const EVERY = 500;
/** More downloads than browsers list otherwise. */
const MOST = 10_000;

/** @param {import("./app.js").App} app @returns {import("./offline/visits.js").Received} */
function received({ walk: { site, stream } }) {
  const files = performance.getEntriesByType("resource").map(({ name }) => name.split("#")[0]);
  const textures = stream.files.map(({ length }, t) => /** @type {[string, number]} */ ([stream.url("texture", t), length]));
  return {
    index: site.address,
    files: files.filter((name) => !name.endsWith(".ptm")),
    textures: textures.filter(([, length]) => length > 0),
  };
}

// Browsers have none without https.
if (worker) {
  performance.setResourceTimingBufferSize(MOST);
  worker.register("offline.js").catch(() => {});
  let before = 0;
  // Once at the first picture, and once everything is there.
  const timer = setInterval(() => {
    const app = /** @type {import("./app.js").App | undefined} */ (Reflect.get(window, "ptm"));
    if (!worker.controller || !app?.walk.begun) return;
    const now = app.walk.complete ? 2 : 1;
    if (now > before) worker.controller.postMessage(received(app));
    before = now;
    if (now === 2) clearInterval(timer);
  }, EVERY);
}
