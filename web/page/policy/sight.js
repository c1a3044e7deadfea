// Computes the needs of the view from the pixels of an item buffer (docs/formats/client.md, step
// 2).

/**
 * @typedef {object} Sight
 * @property {Float64Array} present T × K: of each column of each texture the share of the pixels
 * @property {Float64Array} hidden of each cell the share of the pixels that show its placeholder
 */

/**
 * @param {import("../gl/item-buffer.js").Reading} reading
 * @param {{T: number, C: number, K: number, levels: Int32Array}} catalogue
 * @returns {Sight}
 */
export function sightOf({ pixels, items, pairs, placeholders }, { T, C, K, levels }) {
  const present = new Float64Array(T * K), hidden = new Float64Array(C);
  const each = 1 / pixels;
  const reflects = (/** @type {number} */ probe) => probe >= 0 && (present[probe * K + levels[probe]] += each);
  // Glass covers no pixel.
  for (const [, , probe] of pairs) reflects(probe);
  for (let at = 0; at < 2 * pixels; at += 2) {
    if (!items[at]) continue;
    const [texture, light, probe] = pairs[items[at] - 1];
    reflects(probe);
    // A texel of a lightmap is so large that every pixel wants the finest level.
    for (let k = 0; light >= 0 && k < levels[light]; k++) present[light * K + 1 + k] += each;
    if (texture < 0) continue;
    const count = levels[texture], first = texture * K + 1;
    const wanted = count - Math.min(items[at + 1] / 256, count - 1);
    const whole = Math.floor(wanted);
    for (let n = 0; n < whole; n++) present[first + n] += each;
    if (whole < count) present[first + whole] += (wanted - whole) * each;
  }
  for (let at = 0; placeholders && at < 2 * pixels; at += 2) {
    if (placeholders[at]) hidden[placeholders[at] - 1] += each;
  }
  return { present, hidden };
}
