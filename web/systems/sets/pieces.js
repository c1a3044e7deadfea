// The pieces of the surfaces of a cell, by which the client of interlaced images tells what is in view, how far
// it is, and how large its texels are. A site's GLBs have all walls of a room with one texture in one shape, and
// the box of that holds the visitor; so triangles that share vertices are a piece.

/**
 * @typedef {object} Piece
 * @property {number} texture
 * @property {number[]} low corner of its box, metres
 * @property {number[]} high
 * @property {number[]} side mean width and height of the texture's image on it, metres; 0 if it shows a single
 *   point of it
 */

/** The most pieces of a shape: one that falls into more is a single piece. */
const MOST = 256;

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
  const all = new Group(), rootOf = connected(indices, positions.length / 3);
  /** @type {Map<number, Group>} */
  const groups = new Map();
  for (let k = 0; k < indices.length; k += 3) {
    const triangle = indices.subarray(k, k + 3);
    const corners = Array.from(triangle, (n) => Array.from(positions.subarray(3 * n, 3 * n + 3)));
    const [ab, ac] = [1, 2].map((n) => corners[n].map((x, i) => x - corners[0][i]));
    const cross = [0, 1, 2].map((i) => ab[(i + 1) % 3] * ac[(i + 2) % 3] - ab[(i + 2) % 3] * ac[(i + 1) % 3]);
    const area = Math.hypot(...cross);
    if (!(area > 0)) continue;
    const [u, v] = [0, 1].map((i) => {
      const [b, c] = [1, 2].map((n) => uvs[2 * triangle[n] + i] - uvs[2 * triangle[0] + i]);
      // In the plane, the gradient is as long as its cross product with the normal.
      return Math.hypot(...ab.map((x, n) => c * x - b * ac[n])) / area;
    });
    all.add(corners, area, [u, v]);
    if (groups.size > MOST) continue;
    const root = rootOf(triangle[0]), group = groups.get(root) ?? new Group();
    groups.set(root, group);
    group.add(corners, area, [u, v]);
  }
  return (groups.size > MOST ? [all] : [...groups.values()]).map((group) => group.piece(texture));
}

/**
 * The same vertex for all that triangles connect.
 * @param {Uint16Array | Uint32Array} indices
 * @param {number} count of vertices
 */
function connected(indices, count) {
  const parent = Uint32Array.from({ length: count }, (_, n) => n);
  /** @param {number} n */
  const rootOf = (n) => {
    while (parent[n] !== n) n = parent[n] = parent[parent[n]];
    return n;
  };
  indices.forEach((n, k) => {
    if (k % 3) parent[rootOf(n)] = rootOf(indices[k - 1]);
  });
  return rootOf;
}
