// What the browser itself noted of each download, told to the estimate of the link: its network has a
// clock of its own, so that a main thread that is busy drawing does not pass for a thin link. What the
// page itself took is the first that is known.

/** @param {import("../policy/estimate.js").Estimate} estimate */
export function watchLink(estimate) {
  let id = 0;
  /** @param {PerformanceEntryList} found */
  const note = (found) => {
    const entries = /** @type {PerformanceResourceTiming[]} */ (found);
    for (const entry of entries.sort((a, b) => a.responseEnd - b.responseEnd)) {
      // Nothing that came out of a cache; and other origins may hide how much there was.
      if (!entry.transferSize || !entry.responseStart) continue;
      const number = id++;
      estimate.sent(number, entry.requestStart / 1000);
      estimate.firstByte(number, entry.responseStart / 1000);
      estimate.bytes(entry.responseEnd / 1000, entry.encodedBodySize);
      estimate.finished(number, entry.responseEnd / 1000);
    }
  };
  // Those before are known at once, for the first request to go by.
  note(performance.getEntriesByType("resource"));
  new PerformanceObserver((list) => note(list.getEntries())).observe({ type: "resource" });
}
