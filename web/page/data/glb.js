// Reads the shapes of a cell from its GLB, in the form that docs/formats/gltf.md specifies and no other.

/**
 * Triangles with one look.
 * @typedef {object} Shape
 * @property {string} name of their object
 * @property {Float32Array} positions x, y, z of each vertex, world metres
 * @property {Float32Array | null} uvs u, v of each vertex, from the top left; null without a texture
 * @property {Uint16Array | null} colors r, g, b, 1 of each vertex in linear light, of 65535; null if white
 * @property {Uint16Array | Uint32Array} indices three for each triangle
 * @property {number} texture its place in the index, or -1
 * @property {boolean} clampU whether u stops at the edge of the texture instead of repeating it
 * @property {boolean} clampV
 * @property {number[]} factor r, g, b in linear light, and opacity
 * @property {boolean} blends whether surfaces behind it show through
 * @property {number} cutoff texels of less alpha are not drawn, all others are opaque; 0 if it blends
 * @property {boolean} twoSided
 * @property {number} mesh the place of its object in the index, if that has finer meshes, or -1
 * @property {number} octree the place of its octree texture in the index, or -1
 * @property {number} light the lightmap of its cell in the index, or -1
 * @property {number} white the light that its lightmap calls white, or that its colours are shares of; 0 if unlit
 * @property {Float32Array | null} spots u, v of each vertex in the lightmap, from the top left
 * @property {number} probe the place in the index of what it reflects, or -1
 * @property {Numbers | null} normals x, y, z of each vertex, of 127, if it reflects and is curved
 * @property {number} relief the place of the normal map of its object or its material in the index, or -1
 * @property {Float32Array[] | null} frames of the vertices in the normal map, as `Reliefs` checks them
 * @property {string} extras those of its material as JSON, without the mesh, and its factors
 * @property {number[]} low corner of their box
 * @property {number[]} high
 */

const GLTF = 0x46546c67, JSON_CHUNK = 0x4e4f534a, BINARY_CHUNK = 0x004e4942;
const CLAMP = 33071;
/** Milliseconds of reading without a pause. */
const AT_ONCE = 6;
/** @type {Record<number, typeof Float32Array | typeof Int8Array | typeof Uint8Array | typeof Uint16Array | typeof Uint32Array>} */
const ARRAYS = { 5126: Float32Array, 5120: Int8Array, 5121: Uint8Array, 5123: Uint16Array, 5125: Uint32Array };
/** @type {Record<string, number>} */
const ITEMS = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4 };

/** @typedef {import("../../ptm/src/meshopt.js").ViewDecoder} ViewDecoder */
/** @typedef {Float32Array | Int8Array | Uint8Array | Uint16Array | Uint32Array} Numbers */

/** Linear light of sRGB codes, of 65535. */
const LINEAR = Array.from({ length: 256 }, (_, code) =>
  Math.round(65535 * (code < 11 ? code / 255 / 12.92 : ((code / 255 + 0.055) / 1.055) ** 2.4)));

/** Linear colours of the codes red − green, green, blue − green, modulo 256, and 0. @param {Numbers} codes */
function colorsOf(codes) {
  const colors = new Uint16Array(codes.length).fill(65535);
  for (let k = 0; k < codes.length; k += 4) {
    const green = codes[k + 1];
    colors[k] = LINEAR[codes[k] + green & 255];
    colors[k + 1] = LINEAR[green];
    colors[k + 2] = LINEAR[codes[k + 2] + green & 255];
  }
  return colors;
}

/** The arrays of a GLB, by the numbers of their accessors. */
class Arrays {
  /** Of compressed views: their elements, or indices. @type {Map<number, Uint8Array | Uint32Array>} */
  #decoded = new Map();
  /** @type {Map<number, Numbers>} */
  #read = new Map();

  /**
   * @param {any} tree the JSON of the GLB
   * @param {Uint8Array<ArrayBuffer>} binary its bytes, from a multiple of 4 on
   * @param {ViewDecoder | null} decoder of compressed views
   */
  constructor(tree, binary, decoder) {
    this.tree = tree;
    this.binary = binary;
    this.decoder = decoder;
  }

  /** The numbers of an accessor of vertices, or the colours if they are codes. @param {number} number @returns {Numbers} */
  vertices(number, codes = false) {
    const known = this.#read.get(number);
    if (known) return known;
    const row = this.tree.accessors[number], { bytes, stride } = this.#elements(row.bufferView);
    const Kind = ARRAYS[row.componentType], items = ITEMS[row.type], from = row.byteOffset ?? 0;
    let numbers;
    if (stride === 0 || stride === items * Kind.BYTES_PER_ELEMENT) {
      numbers = new Kind(bytes.buffer, bytes.byteOffset + from, row.count * items);
    } else {
      const all = new Kind(bytes.buffer, bytes.byteOffset + from);
      const step = stride / Kind.BYTES_PER_ELEMENT;
      if ((row.count - 1) * step + items > all.length) throw new Error("has a view that is too short");
      numbers = new Kind(row.count * items);
      for (let k = 0, at = 0; k < row.count; k++, at += step) {
        for (let n = 0; n < items; n++) numbers[items * k + n] = all[at + n];
      }
    }
    if (codes) numbers = colorsOf(numbers);
    this.#read.set(number, numbers);
    return numbers;
  }

  /**
   * The indices of an accessor.
   * @param {number} number
   * @param {number} vertices that they index
   * @returns {Uint16Array | Uint32Array}
   */
  indices(number, vertices) {
    const row = this.tree.accessors[number], view = row.bufferView;
    const coded = this.#coded(view);
    if (!coded) return /** @type {Uint16Array | Uint32Array} */ (this.vertices(number));
    let all = /** @type {Uint32Array | undefined} */ (this.#decoded.get(view));
    if (!all) {
      all = this.#with().triangles(this.#stream(coded), coded.count, vertices);
      this.#decoded.set(view, all);
    }
    const begin = (row.byteOffset ?? 0) / coded.byteStride;
    return all.subarray(begin, begin + row.count);
  }

  /** The bytes of a view, and the distance of its elements, 0 if they are adjacent. @param {number} number */
  #elements(number) {
    const view = this.tree.bufferViews[number], coded = this.#coded(number);
    if (!coded) {
      const begin = view.byteOffset ?? 0;
      return { bytes: this.binary.subarray(begin, begin + view.byteLength), stride: view.byteStride ?? 0 };
    }
    let bytes = /** @type {Uint8Array<ArrayBuffer> | undefined} */ (this.#decoded.get(number));
    if (!bytes) {
      const { count, byteStride, filter } = coded;
      const exponential = filter === "EXPONENTIAL";
      bytes = this.#with().attributes(this.#stream(coded), count, byteStride, exponential);
      this.#decoded.set(number, bytes);
    }
    return { bytes, stride: coded.byteStride };
  }

  /** @param {number} view */
  #coded(view) {
    return this.tree.bufferViews[view].extensions?.EXT_meshopt_compression;
  }

  /** @param {{byteOffset?: number, byteLength: number}} coded */
  #stream({ byteOffset = 0, byteLength }) {
    return this.binary.subarray(byteOffset, byteOffset + byteLength);
  }

  #with() {
    if (!this.decoder) throw new Error("does not say that it is compressed");
    return this.decoder;
  }
}

/**
 * The JSON and the arrays of a GLB. Rejects with an Error if it is damaged, and as `decoder`.
 * @param {ArrayBuffer} buffer
 * @param {() => Promise<ViewDecoder>} decoder called for a compressed GLB
 */
export async function openGlb(buffer, decoder) {
  const view = new DataView(buffer);
  if (buffer.byteLength < 20 || view.getUint32(0, true) !== GLTF) throw new Error("is not a GLB");
  if (view.getUint32(8, true) !== buffer.byteLength) throw new Error("is cut short");
  const length = view.getUint32(12, true);
  if (view.getUint32(16, true) !== JSON_CHUNK) throw new Error("has no JSON");
  const tree = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 20, length)));
  const next = 20 + length;
  let binary = next;
  if (next < buffer.byteLength) {
    if (view.getUint32(next + 4, true) !== BINARY_CHUNK) throw new Error("has no binary chunk");
    binary = next + 8;
  }
  const compressed = tree.extensionsRequired !== undefined;
  return { tree, arrays: new Arrays(tree, new Uint8Array(buffer, binary), compressed ? await decoder() : null) };
}

/**
 * The cell and the shapes of a GLB. Rejects as `openGlb`.
 * @param {ArrayBuffer} buffer
 * @param {number} textures in the index
 * @param {() => Promise<ViewDecoder>} decoder
 * @returns {Promise<{cell: number, shapes: Shape[]}>}
 */
export async function readGlb(buffer, textures, decoder) {
  const { tree, arrays } = await openGlb(buffer, decoder);
  let begun = performance.now();
  // A quarter of a million triangles take several frames.
  const pause = async () => {
    if (performance.now() - begun < AT_ONCE) return;
    await new Promise((resolve) => setTimeout(resolve));
    begun = performance.now();
  };

  /** @type {Shape[]} */
  const shapes = [];
  for (const node of tree.nodes ?? []) {
    for (const { attributes, indices, material } of tree.meshes[node.mesh].primitives) {
      const look = tree.materials[material], base = look.pbrMetallicRoughness ?? {};
      const { texture = -1, mesh = -1, octree = -1, light = -1, white = light < 0 ? 0 : NaN, probe = -1, normal = -1, normalCoords, wrapS, wrapT } =
        look.extras ?? {};
      const textured = texture >= 0 && attributes.TEXCOORD_0 !== undefined;
      const color = attributes._COLOR ?? attributes.COLOR_0, painted = color !== undefined;
      const positions = /** @type {Float32Array} */ (arrays.vertices(attributes.POSITION));
      await pause();
      const uvs = textured ? /** @type {Float32Array} */ (arrays.vertices(attributes.TEXCOORD_0)) : null;
      const colors = painted ? /** @type {Uint16Array} */ (arrays.vertices(color, "_COLOR" in attributes)) : null;
      const spots = light < 0 ? null : /** @type {Float32Array} */ (arrays.vertices(attributes.TEXCOORD_1));
      const normals = probe >= 0 && "NORMAL" in attributes ? arrays.vertices(attributes.NORMAL) : null;
      const framed = normalCoords === undefined ? ["TEXCOORD_1", "NORMAL", "TANGENT"] : ["TEXCOORD_" + normalCoords];
      const frames = normal < 0 ? null : framed.filter((name) => name in attributes)
        .map((name) => /** @type {Float32Array} */ (arrays.vertices(attributes[name])));
      if (![texture, light, probe].every((number) => Number.isInteger(number) && number < textures)) {
        throw new Error("has a texture that is not in the index");
      }
      const factor = base.baseColorFactor ?? [1, 1, 1, 1];
      if (!Array.isArray(factor) || factor.length !== 4 || ![...factor, white].every(Number.isFinite) || white < 0) {
        throw new Error("has an invalid colour");
      }
      for (const each of [uvs, spots]) {
        if (each && 3 * each.length !== 2 * positions.length) throw new Error("has too few coordinates");
      }
      if (colors && 3 * colors.length !== 4 * positions.length) throw new Error("has too few colours");
      await pause();
      const index = arrays.indices(indices, positions.length / 3);
      await pause();
      const own = ownOf(index, { positions, uvs, colors, spots, normals, frames });
      const { low, high } = boxOf(own.positions);
      shapes.push({
        name: node.name ?? "",
        ...own,
        texture: textured ? texture : -1,
        clampU: wrapS === CLAMP,
        clampV: wrapT === CLAMP,
        factor,
        blends: look.alphaMode === "BLEND",
        cutoff: look.alphaMode === "MASK" ? Number(look.alphaCutoff) || 0 : 0,
        twoSided: look.doubleSided === true,
        mesh,
        octree,
        light,
        white,
        probe,
        relief: normal,
        extras: JSON.stringify({ ...base, ...look.extras, mesh: 0 }),
        low,
        high,
      });
    }
  }
  return { cell: tree.scenes[tree.scene ?? 0].extras.cell, shapes };
}

/**
 * The vertices of one shape, of an array that it may share with others.
 * @param {Uint16Array | Uint32Array} index
 * @param {{positions: Float32Array, uvs: Float32Array | null, colors: Uint16Array | null,
 *   spots: Float32Array | null, normals: Numbers | null, frames: Float32Array[] | null}} shared
 */
function ownOf(index, { positions, uvs, colors, spots, normals, frames }) {
  let first = Infinity, last = -1;
  for (let k = 0; k < index.length; k++) {
    if (index[k] < first) first = index[k];
    if (index[k] > last) last = index[k];
  }
  if (last < 0 || 3 * last >= positions.length) throw new Error("has a wrong index");
  const end = last + 1;
  const indices = first ? index.map((n) => n - first) : index;
  return {
    positions: positions.subarray(3 * first, 3 * end),
    uvs: uvs && uvs.subarray(2 * first, 2 * end),
    colors: colors && colors.subarray(4 * first, 4 * end),
    spots: spots && spots.subarray(2 * first, 2 * end),
    normals: normals && normals.subarray(3 * first, 3 * end),
    frames: frames && frames.map((rows, k) => rows.subarray((k + 2) * first, (k + 2) * end)),
    indices,
  };
}

/** @param {Float32Array} positions */
function boxOf(positions) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (let k = 0; k < positions.length; k++) {
    const value = positions[k], axis = k % 3;
    if (value < low[axis]) low[axis] = value;
    if (value > high[axis]) high[axis] = value;
  }
  if (![...low, ...high].every(Number.isFinite)) throw new Error("has a position that is not finite");
  return { low, high };
}
