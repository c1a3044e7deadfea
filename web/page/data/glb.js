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
 * @property {number[]} low corner of their box
 * @property {number[]} high
 */

const GLTF = 0x46546c67, JSON_CHUNK = 0x4e4f534a, BINARY_CHUNK = 0x004e4942;
const CLAMP = 33071;
/** @type {Record<number, typeof Float32Array | typeof Uint16Array | typeof Uint32Array>} */
const ARRAYS = { 5126: Float32Array, 5123: Uint16Array, 5125: Uint32Array };
/** @type {Record<string, number>} */
const ITEMS = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4 };

/**
 * The cell and the shapes of a GLB. Throws an Error if it is damaged.
 * @param {ArrayBuffer} buffer
 * @param {number} [textures] in the index
 * @returns {{cell: number, shapes: Shape[]}}
 */
export function readGlb(buffer, textures = Infinity) {
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

  /** @param {number} number */
  const accessor = (number) => {
    const row = tree.accessors[number], part = tree.bufferViews[row.bufferView];
    const offset = binary + (part.byteOffset ?? 0) + (row.byteOffset ?? 0);
    return new ARRAYS[row.componentType](buffer, offset, row.count * ITEMS[row.type]);
  };

  /** @type {Shape[]} */
  const shapes = [];
  for (const node of tree.nodes ?? []) {
    for (const { attributes, indices, material } of tree.meshes[node.mesh].primitives) {
      const look = tree.materials[material], base = look.pbrMetallicRoughness ?? {};
      const { texture = -1, wrapS, wrapT } = look.extras ?? {};
      const { min, max } = tree.accessors[attributes.POSITION];
      const textured = texture >= 0 && attributes.TEXCOORD_0 !== undefined;
      const index = /** @type {Uint16Array | Uint32Array} */ (accessor(indices));
      const positions = /** @type {Float32Array} */ (accessor(attributes.POSITION));
      const uvs = textured ? /** @type {Float32Array} */ (accessor(attributes.TEXCOORD_0)) : null;
      const painted = attributes.COLOR_0 !== undefined;
      const colors = painted ? /** @type {Uint16Array} */ (accessor(attributes.COLOR_0)) : null;
      if (!Number.isInteger(texture) || texture >= textures) {
        throw new Error("has a texture that is not in the index");
      }
      const factor = base.baseColorFactor ?? [1, 1, 1, 1];
      if (!Array.isArray(factor) || factor.length !== 4 || !factor.every(Number.isFinite)) {
        throw new Error("has an invalid colour");
      }
      if (![min, max].every((corner) => corner?.length === 3 && corner.every(Number.isFinite))) {
        throw new Error("has no bounding box");
      }
      if (uvs && 3 * uvs.length !== 2 * positions.length) throw new Error("has too few coordinates");
      if (colors && 3 * colors.length !== 4 * positions.length) throw new Error("has too few colours");
      let greatest = -1;
      for (let k = 0; k < index.length; k++) if (index[k] > greatest) greatest = index[k];
      if (3 * greatest >= positions.length) throw new Error("has a wrong index");
      shapes.push({
        name: node.name ?? "",
        positions,
        uvs,
        colors,
        indices: index,
        texture: textured ? texture : -1,
        clampU: wrapS === CLAMP,
        clampV: wrapT === CLAMP,
        factor,
        blends: look.alphaMode === "BLEND",
        cutoff: look.alphaMode === "MASK" ? Number(look.alphaCutoff) || 0 : 0,
        twoSided: look.doubleSided === true,
        low: min,
        high: max,
      });
    }
  }
  return { cell: tree.scenes[tree.scene ?? 0].extras.cell, shapes };
}
