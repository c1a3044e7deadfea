// The geometry of a cell on the GPU: one buffer of vertices, one of indices, a range of triangles for
// each material.

/** @typedef {import("../data/glb.js").Shape} Shape */

/**
 * Triangles that are drawn at once.
 * @typedef {object} Batch
 * @property {Shape} look of one of its shapes, whose look all have
 * @property {number} first index
 * @property {number} count of indices
 * @property {number[]} color r, g, b as sRGB encodes them, of a lit surface in linear light, and opacity
 * @property {number[]} low corner of their box
 * @property {number[]} high
 */

/**
 * @typedef {object} Packed
 * @property {Float32Array} data x, y, z, u, v of each vertex; its place u, v in the lightmap, if any has one;
 *   its normal, if any has one, in the bytes of one number, 0 of those without;
 *   and its colour, if any has one: r, g, b, 1 as `codeOf` encodes them, in the bytes of one number
 * @property {boolean} lit whether they have a place in the lightmap
 * @property {boolean} curved whether they have a normal
 * @property {boolean} painted whether they have a colour
 * @property {Uint16Array | Uint32Array} index
 * @property {Batch[]} batches
 */

/** Vertices and indices that are packed without a pause. */
const AT_ONCE = 1 << 14;
/** The most indices of a batch: what lies outside of the view is not drawn, in one large hall, too. */
const MOST = 3 << 11;

/** What shapes of one look have in common. @param {Shape} shape */
export function lookOf({ texture, factor, blends, cutoff, twoSided, extras }) {
  return [texture, factor, blends, cutoff, twoSided, extras].join();
}

/**
 * Packs shapes by their looks, step by step: a million triangles take longer than a frame.
 * @param {Shape[]} shapes
 * @returns {Generator<void, Packed, void>}
 */
export function* pack(shapes) {
  /** @type {Map<string, Shape[]>} */
  const groups = new Map();
  for (const shape of shapes) {
    const key = lookOf(shape);
    const group = groups.get(key);
    if (group) group.push(shape);
    else groups.set(key, [shape]);
  }
  const vertices = shapes.reduce((sum, { positions }) => sum + positions.length / 3, 0);
  const count = shapes.reduce((sum, { indices }) => sum + indices.length, 0);
  const lit = shapes.some(({ spots }) => spots), painted = shapes.some(({ colors }) => colors);
  const curved = shapes.some(({ normals }) => normals), end = 5 + 2 * +lit, width = end + +curved + +painted;
  const data = new Float32Array(width * vertices), bytes = new Uint8Array(data.buffer);
  // 65535 begins another strip.
  const index = vertices > 65535 ? new Uint32Array(count) : new Uint16Array(count);
  /** @type {Batch[]} */
  const batches = [];
  let vertex = 0, at = 0;
  for (const group of groups.values()) {
    const first = at, [look] = group, { factor, white } = look;
    for (const { positions, uvs, colors, spots, normals, indices } of group) {
      yield;
      for (let k = 0; k < indices.length; k++) {
        if (k % AT_ONCE === AT_ONCE - 1) yield;
        index[at++] = vertex + indices[k];
      }
      for (let k = 0; k < positions.length / 3; k++, vertex++) {
        if (k % AT_ONCE === AT_ONCE - 1) yield;
        for (let n = 0; n < 3; n++) {
          data[width * vertex + n] = positions[3 * k + n];
          if (normals) bytes[4 * (width * vertex + end) + n] = normals[3 * k + n];
        }
        for (let n = 0; painted && n < 4; n++) {
          bytes[4 * (width * (vertex + 1) - 1) + n] = colors ? 255 * codeOf(colors[4 * k + n] / 65535, white) + 0.5 : 255;
        }
        for (let n = 0; n < 2; n++) {
          if (uvs) data[width * vertex + 3 + n] = uvs[2 * k + n];
          if (spots) data[width * vertex + 5 + n] = spots[2 * k + n];
        }
      }
    }
    const color = white ? factor : [...factor.slice(0, 3).map(encoded), factor[3]];
    for (let from = first; from < at; from += MOST) {
      const part = index.subarray(from, Math.min(from + MOST, at));
      const box = boxOf(part, data, width);
      batches.push({ look, first: from * index.BYTES_PER_ELEMENT, count: part.length, color, ...box });
      yield;
    }
  }
  return { data, lit, curved, painted, index, batches };
}

/**
 * The corners of the box of some vertices.
 * @param {Uint16Array | Uint32Array} index
 * @param {Float32Array} data
 * @param {number} width numbers of a vertex
 */
function boxOf(index, data, width) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (let k = 0; k < index.length; k++) {
    for (let n = 0, at = width * index[k]; n < 3; n++, at++) {
      if (data[at] < low[n]) low[n] = data[at];
      if (data[at] > high[n]) high[n] = data[at];
    }
  }
  return { low, high };
}

export class CellBuffers {
  /**
   * @param {WebGL2RenderingContext} gl
   * @param {Packed} packed
   * @param {Shape[]} shapes those that were packed
   */
  constructor(gl, { data, lit, curved, painted, index, batches }, shapes) {
    this.gl = gl;
    this.shapes = shapes;
    this.batches = batches;
    this.bytes = data.byteLength + index.byteLength;
    this.type = index instanceof Uint32Array ? gl.UNSIGNED_INT : gl.UNSIGNED_SHORT;
    this.vertexArray = gl.createVertexArray();
    this.buffers = [gl.createBuffer(), gl.createBuffer()];
    gl.bindVertexArray(this.vertexArray);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[0]);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.buffers[1]);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, index, gl.STATIC_DRAW);
    const end = lit ? 28 : 20, far = end + 4 * +curved, stride = far + 4 * +painted;
    /** @param {number} place @param {number} count @param {number} from @param {number} [kind] */
    const attribute = (place, count, from, kind = gl.FLOAT) => {
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, count, kind, kind !== gl.FLOAT, stride, from);
    };
    attribute(0, 3, 0);
    attribute(1, 2, 12);
    gl.vertexAttrib4f(2, 1, 1, 1, 1);
    if (painted) attribute(2, 4, far, gl.UNSIGNED_BYTE);
    if (lit) attribute(3, 2, 20);
    if (curved) attribute(5, 3, end, gl.BYTE);
    gl.bindVertexArray(null);
  }

  /** @param {Batch} batch */
  draw(batch) {
    this.gl.drawElements(this.gl.TRIANGLES, batch.count, this.type, batch.first);
  }

  delete() {
    this.gl.deleteVertexArray(this.vertexArray);
    for (const buffer of this.buffers) this.gl.deleteBuffer(buffer);
  }
}

/**
 * A component of the colour of a vertex in few bits: with light much of it may be far below white.
 * @param {number} share of all light
 * @param {number} white of the light on it, or 0
 */
export const codeOf = (share, white) => (white ? share ** 0.25 : encoded(share));

/**
 * A component of linear light as sRGB encodes it (IEC 61966-2-1).
 * @param {number} light
 */
export function encoded(light) {
  return light <= 0.0031308 ? 12.92 * light : 1.055 * light ** (1 / 2.4) - 0.055;
}
