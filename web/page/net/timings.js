// What the browser itself noted of each download, told to the estimate of the link: its network has a
// clock of its own, so that a main thread that is busy drawing does not pass for a thin link. What the
// page itself took is the first that is known.

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
  // Safari before 16.4 does not say how much there was.
  if (!("transferSize" in PerformanceResourceTiming.prototype)) {
    fetcher.measured = take;
    return;
  }
  /** @param {PerformanceEntryList} found */
  const note = (found) => {
    const entries = /** @type {PerformanceResourceTiming[]} */ (found);
    for (const entry of entries.sort((a, b) => a.responseEnd - b.responseEnd)) {
      // Nothing that came out of a cache; and other origins may hide how much there was.
      if (!entry.transferSize || !entry.responseStart) continue;
      const { requestStart, responseStart, responseEnd, encodedBodySize } = entry;
      take(requestStart / 1000, responseStart / 1000, responseEnd / 1000, encodedBodySize);
    }
  };
  // Those before are known at once, for the first request to go by.
  note(performance.getEntriesByType("resource"));
  new PerformanceObserver((list) => note(list.getEntries())).observe({ type: "resource" });
}
