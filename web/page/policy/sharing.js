// Two steps of the paper's client: sharing memory (§6.1), adding and removing levels (§6.2).

/** @typedef {import("./catalogue.js").Catalogue} Catalogue */
/**
 * A cell in the frustum.
 * @typedef {{weight: number, textures: ArrayLike<number>}} Shown its hint, and the textures of its
 *   shapes in the frustum
 */

/**
 * Adds to `share` (T) the bytes that each texture keeps.
 * @param {Catalogue} stock
 * @param {Shown[]} cells by descending hint
 * @param {Int32Array} column (T)
 * @param {number} budget
 * @param {Float64Array} share
 */
export function shareOut({ K, memory, levels }, cells, column, budget, share) {
  let left = budget, total = cells.reduce((sum, { weight }) => sum + weight, 0);
  for (const { weight, textures } of cells) {
    const mine = total > 0 ? left * weight / total : 0;
    total -= weight;
    let rest = mine;
    for (let s = 0; s < textures.length; s++) {
      const t = textures[s], offer = rest / (textures.length - s);
      const wanted = memory[t * K + Math.min(column[t] + 1, levels[t])];
      if (wanted > share[t] + offer) {
        share[t] += offer;
        rest -= offer;
      } else {
        rest -= Math.max(0, wanted - share[t]);
        share[t] = Math.max(share[t], wanted);
      }
    }
    left -= mine - rest;
  }
}

/**
 * Removes and adds a level of each texture in `column` (T), by its share and its downloads;
 * returns the textures that want their next level downloaded. More levels are removed for as long
 * as all of them exceed the budget, as when it has shrunk.
 * @param {Catalogue} stock
 * @param {Float64Array} share (T) bytes that each keeps
 * @param {Int32Array} have (T)
 * @param {number} budget
 * @param {Int32Array} column
 */
export function refresh({ T, K, memory, levels }, share, have, budget, column) {
  const before = column.slice(), wanted = [];
  let used = budget + 1, removed = true;
  while (removed && used > budget) {
    used = 0;
    removed = false;
    for (let t = 0; t < T; t++) {
      if (column[t] > 0 && memory[t * K + column[t]] > share[t]) {
        column[t]--;
        removed = true;
      }
      used += memory[t * K + column[t]];
    }
  }
  for (let t = 0; t < T; t++) {
    const here = column[t], at = t * K + here;
    if (here < before[t] || here >= levels[t] || memory[at + 1] > share[t]) continue;
    if (here >= have[t]) {
      wanted.push(t);
    } else if (used + memory[at + 1] - memory[at] <= budget) {
      used += memory[at + 1] - memory[at];
      column[t]++;
    }
  }
  return wanted;
}
