// Passes the browser's own timings of each download to the estimate of the link. They come from the
// network process, so that a main thread that is busy drawing is not taken for a slow link. The
// download of the page itself is the first.

/**
 * @param {import("../policy/estimate.js").Estimate} estimate
 * @param {import("./fetcher.js").Fetcher} fetcher
 */
export function watchLink(estimate, fetcher) {
  let id = 0;
  /** @param {number} asked s @param {number} began @param {number} ended @param {number} bytes */
  const take = (asked, began, ended, bytes) => {
    const number = id++;
    estimate.sent(number, asked);
    estimate.firstByte(number, began);
    estimate.bytes(ended, bytes);
    estimate.finished(number, ended);
  };
  // Safari before 16.4 reports no sizes.
  if (!("transferSize" in PerformanceResourceTiming.prototype)) {
    fetcher.measured = take;
    return;
  }
  /** @param {PerformanceEntryList} list */
  const note = (list) => {
    const entries = /** @type {PerformanceResourceTiming[]} */ (list);
    for (const entry of entries.sort((a, b) => a.responseEnd - b.responseEnd)) {
      // Skips cached files, and those of other origins, which may hide their sizes.
      if (!entry.transferSize || !entry.responseStart) continue;
      const { requestStart, responseStart, responseEnd, encodedBodySize } = entry;
      if (entry.nextHopProtocol) estimate.protocol = entry.nextHopProtocol;
      take(requestStart / 1000, responseStart / 1000, responseEnd / 1000, encodedBodySize);
    }
  };
  // Earlier entries are available at once, for the first request.
  note(performance.getEntriesByType("resource"));
  new PerformanceObserver((list) => note(list.getEntries())).observe({ type: "resource" });
}
