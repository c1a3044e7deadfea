// A cache of things with sizes: when it is full, the least recently used one leaves.

export class Lru {
  /** Bytes by number, the least recently used first. @type {Map<number, number>} */
  #kept = new Map();
  bytes = 0;

  /** @param {(number: number) => void} [leave] is called with each one that leaves */
  constructor(leave = () => {}) {
    this.leave = leave;
  }

  /** The numbers of all that it holds. */
  get numbers() {
    return this.#kept.keys();
  }

  /**
   * Makes one the most recently used; others leave until it fits. False if it is larger than the budget.
   * @param {number} number
   * @param {number} bytes
   * @param {number} budget
   */
  use(number, bytes, budget) {
    if (bytes > budget) return false;
    if (this.#kept.delete(number)) this.bytes -= bytes;
    this.shrink(budget - bytes);
    this.#kept.set(number, bytes);
    this.bytes += bytes;
    return true;
  }

  /** The least recently used ones leave until the rest fits. @param {number} budget */
  shrink(budget) {
    for (const number of this.numbers) {
      if (this.bytes <= budget) break;
      this.drop(number);
    }
  }

  /** @param {number} number leaves if it is there */
  drop(number) {
    const bytes = this.#kept.get(number);
    if (bytes === undefined) return;
    this.#kept.delete(number);
    this.bytes -= bytes;
    this.leave(number);
  }
}
