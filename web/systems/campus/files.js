// The meshes and textures of a campus: downloaded and kept in main memory, on the graphics card while shown.

import { openGlb } from "../../page/data/glb.js";
import { checksum } from "../octree/checksum.js";
import { demand } from "../octree/octree.js";

/** @typedef {import("./index.js").CampusFile} CampusFile */

/**
 * @typedef {object} Part triangles of one material
 * @property {number} material
 * @property {Float32Array} positions
 * @property {Float32Array | null} uvs of textures
 * @property {Float32Array | null} spots of the lightmap
 * @property {Uint16Array | null} colors linear light, of 65535
 * @property {Uint16Array | Uint32Array} indices
 */

/**
 * The parts of a mesh.
 * @param {Uint8Array<ArrayBuffer>} body
 * @param {number} materials in the index
 * @returns {Promise<Part[]>}
 */
async function partsOf(body, materials) {
  const { tree, arrays } = await openGlb(body.slice().buffer, async () => {
    throw new Error("is compressed");
  });
  return tree.meshes[tree.nodes[0].mesh].primitives.map((/** @type {any} */ { attributes, indices, material }) => {
    const number = tree.materials[material].extras.material;
    demand(Number.isInteger(number) && number >= 0 && number < materials, "a material that is not there");
    /** @param {string} name @param {number} items @returns {any} */
    const array = (name, items) => {
      if (attributes[name] === undefined) return null;
      const numbers = arrays.vertices(attributes[name]);
      demand(numbers.length * 3 === positions.length * items, "arrays of other lengths");
      return numbers;
    };
    const positions = /** @type {Float32Array} */ (arrays.vertices(attributes.POSITION));
    demand(positions instanceof Float32Array && positions.every(Number.isFinite), "positions that are not finite");
    const index = arrays.indices(indices, positions.length / 3);
    demand(index.every((one) => one < positions.length / 3), "an index out of range");
    return {
      material: number, positions, indices: index,
      uvs: array("TEXCOORD_0", 2), spots: array("TEXCOORD_1", 2), colors: array("COLOR_0", 4),
    };
  });
}

/** A mesh on the graphics card. */
class Buffers {
  /** @param {WebGL2RenderingContext} gl @param {Part[]} parts */
  constructor(gl, parts) {
    this.gl = gl;
    /** @type {WebGLBuffer[]} */
    this.buffers = [];
    this.bytes = 0;
    this.parts = parts.map((part) => {
      const array = gl.createVertexArray();
      gl.bindVertexArray(array);
      this.#attribute(0, part.positions, 3, false, [0, 0, 0]);
      this.#attribute(1, part.uvs, 2, false, [0, 0, 0]);
      this.#attribute(2, part.colors, 4, true, [1, 1, 1]);
      this.#attribute(3, part.spots, 2, false, [0, 0, 0]);
      this.#buffer(gl.ELEMENT_ARRAY_BUFFER, /** @type {any} */ (part.indices));
      gl.bindVertexArray(null);
      const type = part.indices instanceof Uint16Array ? gl.UNSIGNED_SHORT : gl.UNSIGNED_INT;
      return { part, array, count: part.indices.length, type };
    });
  }

  /** @param {number} kind @param {ArrayBufferView<ArrayBuffer>} data */
  #buffer(kind, data) {
    const { gl } = this, buffer = gl.createBuffer();
    gl.bindBuffer(kind, buffer);
    gl.bufferData(kind, data, gl.STATIC_DRAW);
    this.buffers.push(buffer);
    this.bytes += data.byteLength;
  }

  /** @param {number} place @param {Float32Array | Uint16Array | null} data @param {number} items
   * @param {boolean} normalised @param {number[]} otherwise */
  #attribute(place, data, items, normalised, [x, y, z]) {
    const { gl } = this;
    if (!data) return gl.vertexAttrib4f(place, x, y, z, 1);
    this.#buffer(gl.ARRAY_BUFFER, /** @type {any} */ (data));
    gl.enableVertexAttribArray(place);
    const type = data instanceof Float32Array ? gl.FLOAT : gl.UNSIGNED_SHORT;
    gl.vertexAttribPointer(place, items, type, normalised, 0, 0);
  }

  delete() {
    for (const { array } of this.parts) this.gl.deleteVertexArray(array);
    for (const buffer of this.buffers) this.gl.deleteBuffer(buffer);
  }
}

/** A texture on the graphics card, with all mip levels. */
class Image {
  /** @param {WebGL2RenderingContext} gl @param {ImageBitmap} bitmap @param {boolean} linear whether its
   * numbers are linear, and not sRGB */
  constructor(gl, bitmap, linear) {
    this.gl = gl;
    const { width, height } = bitmap, levels = Math.floor(Math.log2(Math.max(width, height))) + 1;
    this.texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.texStorage2D(gl.TEXTURE_2D, levels, linear ? gl.RGBA8 : gl.SRGB8_ALPHA8, width, height);
    gl.pixelStorei(gl.UNPACK_COLORSPACE_CONVERSION_WEBGL, gl.NONE);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, gl.RGBA, gl.UNSIGNED_BYTE, bitmap);
    gl.generateMipmap(gl.TEXTURE_2D);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
    this.bytes = Math.floor((4 * width * height * 4) / 3);
  }

  delete() {
    this.gl.deleteTexture(this.texture);
  }
}

export class CampusFiles {
  /** In main memory, images as they came. @type {Map<string, Part[] | Blob>} */
  #kept = new Map();
  /** On the graphics card; null while an image is decoded again. @type {Map<string, Buffers | Image | null>} */
  #shown = new Map();
  /** Images that are decoded again, once even if they are freed and shown meanwhile. @type {Set<string>} */
  #decoding = new Set();
  /** Number of changes on the graphics card. */
  changes = 0;

  /** @param {WebGL2RenderingContext} gl @param {import("./index.js").CampusIndex} index
   * @param {(file: string) => string} urlOf @param {import("../../page/net/fetcher.js").Fetcher} fetcher */
  constructor(gl, index, urlOf, fetcher) {
    this.gl = gl;
    this.index = index;
    this.urlOf = urlOf;
    this.fetcher = fetcher;
  }

  /** Downloads a file. @param {string} name @param {() => void} arrived called before it is decoded */
  async load(name, arrived) {
    const row = /** @type {CampusFile} */ (this.index.files.get(name));
    const content = await this.fetcher.whole(this.urlOf(name), async (body) => {
      demand(body.length === row.bytes && checksum(body) === row.crc32, "another checksum");
      arrived();
      if (row.size === undefined) return partsOf(body, this.index.materials.length);
      const blob = new Blob([body], { type: "image/jpeg" });
      const bitmap = await createImageBitmap(blob, { colorSpaceConversion: "none" });
      demand(bitmap.width === row.size && bitmap.height === row.size, "an image of another size");
      this.#upload(name, bitmap);
      return blob;
    });
    this.#kept.set(name, content);
  }

  /** The HTML of a record. @param {{file: string, bytes: number, crc32: number}} row */
  record({ file, bytes, crc32 }) {
    return this.fetcher.whole(this.urlOf(file), (body) => {
      demand(body.length === bytes && checksum(body) === crc32, "another checksum");
      return new TextDecoder("utf-8", { fatal: true }).decode(body);
    });
  }

  /** @param {string} name @param {ImageBitmap} bitmap */
  #upload(name, bitmap) {
    this.#shown.get(name)?.delete();
    this.#shown.set(name, new Image(this.gl, bitmap, this.index.files.get(name)?.channel === "a"));
    this.changes++;
    bitmap.close();
  }

  /** The parts of a mesh in main memory. @param {string} name @returns {Part[] | null} */
  parts(name) {
    return /** @type {Part[] | undefined} */ (this.#kept.get(name)) ?? null;
  }

  /** A mesh on the graphics card, or null if it was not downloaded. @param {string} name */
  mesh(name) {
    const shown = this.#shown.get(name), parts = this.parts(name);
    if (shown || !parts) return /** @type {Buffers | undefined} */ (shown) ?? null;
    const buffers = new Buffers(this.gl, parts);
    this.#shown.set(name, buffers);
    return buffers;
  }

  /** A texture on the graphics card; null if it was not downloaded, or while it is decoded again.
   * @param {string} name */
  texture(name) {
    const shown = this.#shown.get(name), blob = this.#kept.get(name);
    if (shown === undefined && blob) {
      this.#shown.set(name, null);
      if (this.#decoding.has(name)) return null;
      this.#decoding.add(name);
      createImageBitmap(/** @type {Blob} */ (blob), { colorSpaceConversion: "none" }).then((bitmap) => {
        if (this.#shown.has(name)) this.#upload(name, bitmap);
        else bitmap.close();
      }, () => {}).finally(() => this.#decoding.delete(name));
    }
    return /** @type {Image | null | undefined} */ (shown) ?? null;
  }

  /** Frees the graphics memory of all files but these. @param {Set<string>} names */
  keep(names) {
    for (const [name, shown] of this.#shown) {
      if (names.has(name)) continue;
      shown?.delete();
      this.#shown.delete(name);
      this.changes++;
    }
  }

  /** Bytes on the graphics card. */
  get bytes() {
    let sum = 0;
    for (const shown of this.#shown.values()) sum += shown?.bytes ?? 0;
    return sum;
  }
}
