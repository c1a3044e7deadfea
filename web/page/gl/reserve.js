// The part of the budget that stays free for a texture that is in memory twice while it grows or
// shrinks: at most the largest texture without its finest level.
//
// The reserve decides which levels fit, and these decide the reserve. So it never shrinks while the
// visitor stays in a cell; otherwise a level could come and go.

export class Reserve {
  /** Bytes that are kept free. */
  bytes = 0;
  #cell = -1;
  #budget = -1;

  /** @param {import("../policy/catalogue.js").Catalogue} catalogue */
  constructor(catalogue) {
    this.catalogue = catalogue;
  }

  /**
   * Resets the reserve in another cell, and for another budget.
   * @param {number} cell that the visitor is in
   * @param {number} budget bytes
   */
  enter(cell, budget) {
    if (cell === this.#cell && budget === this.#budget) return;
    this.#cell = cell;
    this.#budget = budget;
    this.bytes = 0;
  }

  /** Whether these columns need more than is kept free; it is from now on. @param {Int32Array} column */
  grow(column) {
    const { K, memory } = this.catalogue;
    const need = column.reduce((most, k, t) => (k > 0 ? Math.max(most, memory[t * K + k - 1]) : most), 0);
    // Of a texture that fits, all levels but the finest take less than half.
    const bytes = Math.min(need, this.#budget / 2);
    if (bytes <= this.bytes) return false;
    this.bytes = bytes;
    return true;
  }
}
