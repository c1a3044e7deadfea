// Chooses the levels that are worth most for their bytes. Each level has a worth of its own, but a
// coarse level that adds nothing may lead to a fine one that does: so a step is any number of levels,
// and the best step has the greatest worth per byte. Taking steps of all textures in that order, as
// long as they fit, solves greedily a knapsack whose items are chains. A request may leap,
// too: a preview competes with the exact levels by its gain over everything requested before.

/** @typedef {import("./catalogue.js").Catalogue} Catalogue */
/** @typedef {import("./downloads.js").Kind} Kind */

/**
 * The best next request, or a step of one texture.
 * @typedef {{density: number, texture: number, column: number, preview: number}} Step worth per byte,
 *   of which texture (−1: none), and the column that it leads to, or the preview (−1: exact levels)
 */

/** @returns {Step} */
const noStep = () => ({ density: 0, texture: -1, column: 0, preview: -1 });

/**
 * The best step of a texture: written to `step`, its density 0 if none is worth anything.
 * @param {Float64Array} worth (T × K) of each column beside those before it
 * @param {Float64Array} cost (T × K) bytes up to each column
 * @param {number} at index of the texture's row
 * @param {number} column the present column
 * @param {number} paid bytes already paid, at least those of `column`
 * @param {number} last the furthest column
 * @param {Step} step
 * @param {number} total worth of the step before its first column: 0, or less where a preview gives
 *   more than the present column
 */
export function bestStep(worth, cost, at, column, paid, last, step, total = 0) {
  let best = 0, to = column;
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
  step.preview = -1;
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
  const count = last.length, wide = cost.length / count;
  const density = new Float64Array(count), to = new Int32Array(count), limit = last.slice();
  const step = noStep();
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
 * The texture whose next bytes are worth most: exact levels, or a preview.
 * @param {Float64Array} worth ((T + P) × K) of each column by each source, see `bestStep`
 * @param {Pick<Catalogue, "ends" | "stored" | "previews">} stock
 * @param {Float64Array} asked (T) bytes of `.ptm`s requested already
 * @param {Int32Array} last (T) wanted columns
 * @param {number} overhead bytes that a request takes besides
 * @param {(kind: Kind, number: number) => boolean} free whether it may be requested
 * @param {(preview: number) => boolean} requested whether it is on its way or here
 * @returns {Step}
 */
export function nextFetch(worth, stock, asked, last, overhead, free, requested) {
  const { ends, stored, previews: { first, column, bytes } } = stock;
  const count = last.length, wide = ends.length / count;
  const best = noStep(), step = noStep();
  /** The greatest worth of a preview. @param {number} p @param {number} limit */
  const worthOf = (p, limit) => {
    let total = 0, most = 0;
    for (let k = 1, at = (count + p) * wide + 1; k <= Math.min(column[p], limit); k++, at++) {
      total += worth[at];
      most = Math.max(most, total);
    }
    return most;
  };
  for (let t = 0; t < count; t++) {
    const at = t * wide, until = Math.min(last[t], stored[t]);
    let here = 0, present = 0;
    while (here < until && ends[at + here + 1] <= asked[t]) present += worth[at + ++here];
    // Beside a preview's finer columns the last exact ones would be worth nothing.
    let most = present, below = present;
    for (let p = first[t]; p < first[t + 1]; p++) {
      if (!requested(p)) continue;
      most = Math.max(most, worthOf(p, last[t]));
      below = Math.max(below, worthOf(p, until));
    }
    step.density = 0;
    if (here < until && free("texture", t)) {
      bestStep(worth, ends, at, here, asked[t] - overhead, until, step, present - below);
    }
    for (let p = first[t]; p < first[t + 1]; p++) {
      if (!free("preview", p)) continue;
      const density = (worthOf(p, last[t]) - most) / (bytes[p] + overhead);
      if (density > 0 && density >= step.density) {
        step.density = density;
        step.preview = p;
      }
    }
    if (step.density > best.density) Object.assign(best, step, { texture: t });
  }
  return best;
}
