// The timings of downloads by a service worker. A page sees its requests to the worker only, and takes them for
// cached files; its estimate of the link needs what the worker has received.

/** A download: when it was asked for, began and ended, ms since 1970; bytes, and the protocol.
 * @typedef {{asked: number, began: number, ended: number, bytes: number, protocol: string}} Timing */

/** Calls `tell` with downloads. @param {(timings: Timing[]) => void} tell */
export function watchDownloads(tell) {
  new PerformanceObserver((list) => {
    const entries = /** @type {PerformanceResourceTiming[]} */ (list.getEntries());
    const { timeOrigin: origin } = performance;
    const timings = entries.filter(({ transferSize, responseStart }) => transferSize && responseStart).map((entry) => ({
      asked: origin + entry.requestStart, began: origin + entry.responseStart, ended: origin + entry.responseEnd,
      bytes: entry.encodedBodySize, protocol: entry.nextHopProtocol,
    }));
    if (timings.length) tell(timings);
  }).observe({ type: "resource" });
}

/** Downloads become those of an estimate. @param {import("../policy/estimate.js").Estimate} estimate
 * @param {Timing[]} timings */
export function learn(estimate, timings) {
  for (const { asked, began, ended, bytes, protocol } of timings.sort((a, b) => a.ended - b.ended)) {
    const id = {}, [sent, first, last] = [asked, began, ended].map((at) => (at - performance.timeOrigin) / 1000);
    if (protocol) estimate.protocol = protocol;
    estimate.sent(id, sent);
    estimate.firstByte(id, first);
    estimate.bytes(last, bytes);
    estimate.finished(id, last);
  }
}
