// The geometry of a cell on the GPU: one buffer of vertices, one of indices, a range of triangles for
// each look.

/** @typedef {import("../data/glb.js").Shape} Shape */

/**
 * Triangles that are drawn at once.
 * @typedef {object} Batch
 * @property {Shape} look of one of its shapes, whose look all have
 * @property {number} first index
 * @property {number} count of indices
 * @property {number[]} color r, g, b as sRGB encodes them, and opacity
 * @property {number[]} low corner of their box
 * @property {number[]} high
 */

/**
 * @typedef {object} Packed
 * @property {Float32Array} data x, y, z, u, v of each vertex
 * @property {Uint16Array | Uint32Array} index
 * @property {Batch[]} batches
 */

/** Vertices and indices that are packed without a pause. */
const AT_ONCE = 1 << 14;

/**
 * Packs shapes by their looks, step by step: a million triangles take longer than a frame.
 * @param {Shape[]} shapes
 * @returns {Generator<void, Packed, void>}
 */
export function* pack(shapes) {
  /** @type {Map<string, Shape[]>} */
  const groups = new Map();
  for (const shape of shapes) {
    const { texture, clampU, clampV, factor, blends, twoSided } = shape;
    const key = [texture, clampU, clampV, factor, blends, twoSided].join();
    const group = groups.get(key);
    if (group) group.push(shape);
    else groups.set(key, [shape]);
  }
  const vertices = shapes.reduce((sum, { positions }) => sum + positions.length / 3, 0);
  const count = shapes.reduce((sum, { indices }) => sum + indices.length, 0);
  const data = new Float32Array(5 * vertices);
  // 65535 begins another strip.
  const index = vertices > 65535 ? new Uint32Array(count) : new Uint16Array(count);
  /** @type {Batch[]} */
  const batches = [];
  let vertex = 0, at = 0;
  for (const group of groups.values()) {
    const first = at;
    for (const { positions, uvs, indices } of group) {
      yield;
      for (let k = 0; k < indices.length; k++) {
        if (k % AT_ONCE === AT_ONCE - 1) yield;
        index[at++] = vertex + indices[k];
      }
      for (let k = 0; k < positions.length / 3; k++, vertex++) {
        if (k % AT_ONCE === AT_ONCE - 1) yield;
        for (let n = 0; n < 3; n++) data[5 * vertex + n] = positions[3 * k + n];
        if (!uvs) continue;
        data[5 * vertex + 3] = uvs[2 * k];
        data[5 * vertex + 4] = uvs[2 * k + 1];
      }
    }
    const factor = group[0].factor;
    batches.push({
      look: group[0],
      first: first * index.BYTES_PER_ELEMENT,
      count: at - first,
      color: [...factor.slice(0, 3).map(encoded), factor[3]],
      low: [0, 1, 2].map((k) => Math.min(...group.map(({ low }) => low[k]))),
      high: [0, 1, 2].map((k) => Math.max(...group.map(({ high }) => high[k]))),
    });
  }
  return { data, index, batches };
}

export class CellBuffers {
  /**
   * @param {WebGL2RenderingContext} gl
   * @param {Packed} packed
   */
  constructor(gl, { data, index, batches }) {
    this.gl = gl;
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
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 20, 0);
    gl.enableVertexAttribArray(1);
    gl.vertexAttribPointer(1, 2, gl.FLOAT, false, 20, 12);
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
 * A component of linear light as sRGB encodes it (IEC 61966-2-1).
 * @param {number} light
 */
function encoded(light) {
  return light <= 0.0031308 ? 12.92 * light : 1.055 * light ** (1 / 2.4) - 0.055;
}
