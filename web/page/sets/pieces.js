// The pieces of the surfaces of a cell, by which the client of interlaced images tells what is in view, how far
// it is, and how large its texels are. A site's GLBs have all walls of a room with one texture in one shape, and
// the box of that holds the visitor; so a shape of few planes has a piece for each of them.

/**
 * @typedef {object} Piece
 * @property {number} texture
 * @property {number[]} low corner of its box, metres
 * @property {number[]} high
 * @property {number[]} side mean width and height of the texture's image on it, metres; 0 if it shows a single
 *   point of it
 */

/** The most planes of a shape; one of more is a piece. Parts of a normal, and of a metre, that are told apart. */
const PLANES = 64, TURN = 50, SHIFT = 50;

/** Triangles of a shape. */
class Group {
  low = [Infinity, Infinity, Infinity];
  high = [-Infinity, -Infinity, -Infinity];
  #area = 0;
  #slopes = [0, 0];

  /** @param {number[][]} corners @param {number} area twice that of the triangle @param {number[]} slopes of u and v */
  add(corners, area, slopes) {
    for (const corner of corners) {
      this.low = this.low.map((x, i) => Math.min(x, corner[i]));
      this.high = this.high.map((x, i) => Math.max(x, corner[i]));
    }
    this.#area += area;
    this.#slopes = this.#slopes.map((sum, i) => sum + area * slopes[i]);
  }

  /** @param {number} texture @returns {Piece} */
  piece(texture) {
    const side = this.#slopes.map((sum) => (sum > 0 ? this.#area / sum : 0));
    return { texture, low: this.low, high: this.high, side };
  }
}

/**
 * @param {{positions: Float32Array, indices: Uint16Array | Uint32Array}} shape
 * @param {number} texture
 * @param {Float32Array} uvs u, v of each vertex
 * @returns {Piece[]}
 */
export function piecesOf({ positions, indices }, texture, uvs) {
  const all = new Group();
  /** @type {Map<string, Group>} */
  const planes = new Map();
  for (let k = 0; k < indices.length; k += 3) {
    const triangle = indices.subarray(k, k + 3);
    const corners = Array.from(triangle, (n) => Array.from(positions.subarray(3 * n, 3 * n + 3)));
    const [a, ab, ac] = [corners[0], ...[1, 2].map((n) => corners[n].map((x, i) => x - corners[0][i]))];
    const cross = [0, 1, 2].map((i) => ab[(i + 1) % 3] * ac[(i + 2) % 3] - ab[(i + 2) % 3] * ac[(i + 1) % 3]);
    const area = Math.hypot(...cross);
    if (!(area > 0)) continue;
    const [u, v] = [0, 1].map((i) => {
      const [b, c] = [1, 2].map((n) => uvs[2 * triangle[n] + i] - uvs[2 * triangle[0] + i]);
      // In the plane, the gradient is as long as its cross product with the normal.
      return Math.hypot(...ab.map((x, n) => c * x - b * ac[n])) / area;
    });
    all.add(corners, area, [u, v]);
    if (planes.size > PLANES) continue;
    const normal = cross.map((x) => x / area), shift = normal.reduce((sum, x, i) => sum + x * a[i], 0);
    const key = [...normal.map((x) => TURN * x), SHIFT * shift].map(Math.round).join();
    const group = planes.get(key) ?? new Group();
    planes.set(key, group);
    group.add(corners, area, [u, v]);
  }
  const groups = planes.size > PLANES ? [all] : [...planes.values()];
  return groups.map((group) => group.piece(texture));
}
