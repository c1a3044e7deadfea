// Chooses the levels that are worth most for their bytes. Each level has a worth of its own, but a
// coarse level that adds nothing may lead to a fine one that does: so a step is any number of levels,
// and the best step has the greatest worth per byte. Taking steps of all textures in that order, as
// long as they fit, solves greedily a knapsack whose items are chains.

/**
 * The best next request, or a step of one texture.
 * @typedef {{density: number, texture: number, column: number}} Step worth per byte, of which
 *   texture (−1: none), and the column that it leads to
 */

/**
 * The best step of a texture: written to `step`, its density 0 if none is worth anything.
 * @param {Float64Array} worth (T × K) of each column beside those before it
 * @param {Float64Array} cost (T × K) bytes up to each column
 * @param {number} at index of the texture's row
 * @param {number} column the present column
 * @param {number} paid bytes already paid, at least those of `column`
 * @param {number} last the furthest column
 * @param {Step} step
 */
export function bestStep(worth, cost, at, column, paid, last, step) {
  let best = 0, to = column, total = 0;
  for (let k = column + 1; k <= last; k++) {
    total += worth[at + k];
    const density = total / Math.max(cost[at + k] - paid, 1);
    if (total > 0 && density >= best) {
      best = density;
      to = k;
    }
  }
  step.density = best;
  step.column = to;
}

/**
 * Writes to `column` (T) the column of each texture; returns the bytes, at most `budget`.
 * @param {Float64Array} worth (T × K) see `bestStep`
 * @param {Float64Array} cost
 * @param {Int32Array} last (T) the last column that each may have
 * @param {number} budget bytes
 * @param {Int32Array} column
 */
export function allocate(worth, cost, last, budget, column) {
  const count = last.length, wide = worth.length / count;
  const density = new Float64Array(count), to = new Int32Array(count), limit = last.slice();
  /** @type {Step} */
  const step = { density: 0, texture: -1, column: 0 };
  /** @param {number} t whether it has a step left, which is stored */
  const steps = (t) => {
    const at = t * wide, here = column[t];
    bestStep(worth, cost, at, here, cost[at + here], limit[t], step);
    density[t] = step.density;
    to[t] = step.column;
    return to[t] > here;
  };
  // A binary heap of textures, the densest step first, of equal ones that of the first texture.
  const heap = new Int32Array(count);
  let size = 0;
  /** @param {number} a @param {number} b */
  const before = (a, b) => density[a] > density[b] || (density[a] === density[b] && a < b);
  /** @param {number} i moves the texture at i down */
  const sink = (i) => {
    const t = heap[i];
    for (;;) {
      let child = 2 * i + 1;
      if (child + 1 < size && before(heap[child + 1], heap[child])) child++;
      if (child >= size || before(t, heap[child])) break;
      heap[i] = heap[child];
      i = child;
    }
    heap[i] = t;
  };

  column.fill(0);
  for (let t = 0; t < count; t++) if (steps(t)) heap[size++] = t;
  for (let i = (size >> 1) - 1; i >= 0; i--) sink(i);
  let used = 0;
  while (size > 0) {
    const t = heap[0], at = t * wide;
    const more = cost[at + to[t]] - cost[at + column[t]];
    if (used + more <= budget) {
      used += more;
      column[t] = to[t];
    } else {
      limit[t] = to[t] - 1;
    }
    if (!steps(t)) heap[0] = heap[--size];
    if (size > 0) sink(0);
  }
  return used;
}

/**
 * The texture whose next bytes are worth most.
 * @param {Float64Array} worth (T × K)
 * @param {Float64Array} ends (T × K)
 * @param {Float64Array} asked (T) bytes requested already
 * @param {Int32Array} last (T) wanted columns
 * @param {number} overhead bytes that a request takes besides
 * @param {(texture: number) => boolean} free whether it may be requested
 * @returns {Step}
 */
export function nextFetch(worth, ends, asked, last, overhead, free) {
  const count = last.length, wide = worth.length / count;
  /** @type {Step} */
  const best = { density: 0, texture: -1, column: 0 };
  /** @type {Step} */
  const step = { density: 0, texture: -1, column: 0 };
  for (let t = 0; t < count; t++) {
    const at = t * wide;
    if (asked[t] >= ends[at + last[t]] || !free(t)) continue;
    let here = 0;
    while (here < last[t] && ends[at + here + 1] <= asked[t]) here++;
    bestStep(worth, ends, at, here, asked[t] - overhead, last[t], step);
    if (step.density > best.density) {
      best.density = step.density;
      best.texture = t;
      best.column = step.column;
    }
  }
  return best;
}
