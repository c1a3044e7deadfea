// The service worker of sites that were published with `--offline`: a walk that was visited works without a
// network. Documents come from the host if it answers; files with a hash in their name are fetched once.

import { Store } from "./offline/store.js";
import { watchDownloads } from "./offline/timings.js";
import { Visits } from "./offline/visits.js";

const worker = /** @type {any} */ (globalThis);
const { scope } = worker.registration;
/** Sites of one origin share its storage. */
const NAME = `ptm-walk ${scope}`;
/** Downloads whose timings are remembered. */
const MOST = 64;

/** A worker that a later version has removed still answers for a page that is open: only a page with `--offline`
 * creates the storage again. */
async function openCache(create = false) {
  if (!create && !(await caches.has(NAME))) throw new Error("removed");
  return caches.open(NAME);
}

const visits = new Visits(
  new Store(openCache, (request) => fetch(request)),
  scope,
  async () => {
    await worker.registration.unregister();
    await caches.delete(NAME);
  },
);
/** @param {any} event */
const laterOf = (event) => (/** @type {Promise<unknown>} */ work) => event.waitUntil(work.catch(() => {}));

worker.oninstall = (/** @type {any} */ event) => {
  worker.skipWaiting();
  event.waitUntil(openCache(true));
};
worker.onactivate = (/** @type {any} */ event) => event.waitUntil(worker.clients.claim());
worker.onfetch = (/** @type {any} */ event) => {
  const answer = visits.answer(event.request, laterOf(event));
  if (answer) event.respondWith(answer);
};
/** The last downloads: a page that begins has not heard of its first ones.
 * @type {import("./offline/timings.js").Timing[]} */
let recent = [];
watchDownloads(async (timings) => {
  recent = [...recent, ...timings].slice(-MOST);
  for (const client of await worker.clients.matchAll()) client.postMessage(timings);
});
worker.onmessage = (/** @type {any} */ event) => {
  const { data, source } = event;
  if ("index" in data) return laterOf(event)(visits.keep(data));
  source.postMessage(recent.filter(({ asked }) => asked >= data.since));
};
