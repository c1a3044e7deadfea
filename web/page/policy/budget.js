// The search for a budget of texture memory (§6.1: "either user defined, or benchmarked for the given
// graphics hardware").

/** Factor between the budget and the least that is known to be too much. */
const CLOSE = 2 ** 0.25;

/**
 * The largest budget whose textures take no longer than a limit to draw; 0 if not even the least does.
 * A budget that is too large must not be known to be too large by more than a factor of √√2. Doubles
 * the budget while it keeps the limit, since too many textures take memory from other programs.
 * @param {number} least bytes
 * @param {number} most bytes
 * @param {number} limit s
 * @param {(bytes: number) => Promise<number>} seconds of a picture with textures of
 *   that size; ascending
 */
export async function largestBudget(least, most, limit, seconds) {
  let keeps = 0, misses = Infinity, bytes = Math.min(least, most);
  while (keeps < most && misses > CLOSE * keeps) {
    if (await seconds(bytes) <= limit) keeps = bytes;
    else misses = bytes;
    if (!keeps) return 0;
    bytes = misses < Infinity ? Math.sqrt(keeps * misses) : Math.min(2 * keeps, most);
  }
  return keeps;
}
