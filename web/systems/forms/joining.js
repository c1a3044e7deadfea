// Joins the files of an interlaced image on the graphics card, step by step, by drawing alternately into
// two textures (docs/formats/interlace.md; Englert et al., section 3.2).

import { programOf } from "../../page/gl/program.js";
import { PageError } from "../../page/net/errors.js";
import { checksum } from "../octree/checksum.js";
import { demand, isWhole } from "../octree/octree.js";
import { objects } from "../../page/words/english.js";

const MEDIA = /** @type {Record<string, string>} */ ({ png: "image/png", jpg: "image/jpeg", webp: "image/webp" });
const WIDEST = 1 << 16;
/** Bytes of the largest image, as a texture of four bytes a texel: a step needs it twice at most, and the file. */
const LARGEST = 2 ** 30;

/**
 * @typedef {object} Part a file
 * @property {string} name
 * @property {number} width
 * @property {number} height
 * @property {number} bytes
 * @property {number} crc32
 * @property {"columns" | "rows" | null} axis null for the first
 * @property {{width: number, height: number}} joined
 *
 * @typedef {object} SetIndex what the page needs of `interlace.json`
 * @property {number} width
 * @property {number} height
 * @property {{width: number, height: number}} original
 * @property {string} container
 * @property {boolean} lossless
 * @property {number} components the last of 2 or 4 is alpha
 * @property {string} kind of its components
 * @property {Part[]} files
 */

/** Checks the fields of `interlace.json` that the page needs. @param {any} index @returns {SetIndex} */
export function checkedSet(index) {
  demand(index?.format === "ptmtools interlaced image" && index.schema === 1, "not an index of an interlaced image");
  const { width, height, container, files, kind, original } = index;
  const isSide = (/** @type {unknown} */ side) => isWhole(side, 1, WIDEST);
  demand(isSide(width) && isSide(height) && isSide(original?.width) && isSide(original?.height), "no size");
  demand(container in MEDIA && (kind === "uint8" || kind === "uint16"), "another container");
  demand(Array.isArray(files) && isWhole(files.length, 1, 33), "no files");
  let before = { width: 0, height: 0 };
  /** @type {Part[]} */ (files).forEach((part, k) => {
    const { axis, joined } = part;
    demand(part.name === `${k + 1}.${container}`, "a file of another name");
    demand(isSide(part.width) && isSide(part.height), "a file without size");
    // An incompressible file of 16 bits has eight bytes a texel, and heads.
    demand(isWhole(part.bytes, 1, 9 * part.width * part.height + 2 ** 20), "a file of too many bytes");
    demand(isWhole(part.crc32, 0, 0xffffffff) && (k ? axis === "columns" || axis === "rows" : axis === null), "no axis");
    const [across, down] = !k ? [1, 1] : axis === "columns" ? [2, 1] : [1, 2];
    if (!k) before = { width: part.width, height: part.height };
    demand(part.width === before.width && part.height === before.height, "a file of another size");
    before = { width: across * before.width, height: down * before.height };
    demand(joined?.width === before.width && joined?.height === before.height, "a step of another size");
  });
  demand(before.width === width && before.height === height, "steps that do not make the image");
  return index;
}

const QUAD = `#version 300 es
void main() {
  gl_Position = vec4(4 * (gl_VertexID & 1) - 1, 4 * (gl_VertexID >> 1) - 1, 0, 1);
}`;

/** The step of the paper (Eq. 1). In two channels the second is alpha. */
const JOIN = `#version 300 es
precision highp float;
precision highp sampler2D;
uniform sampler2D before, next, pattern;
uniform vec2 size;
uniform bool pairs;
out vec4 texel;
void main() {
  vec2 place = gl_FragCoord.xy / size;
  vec4 added = texture(next, place);
  if (pairs) added = added.rarr;
  texel = texture(pattern, place * size / 2.0).r == 0.0 ? texture(before, place) : added;
}`;

/** Texels that decide between the image so far and the next file; 2 × 2, repeated. */
const PATTERNS = { columns: [0, 255, 0, 255], rows: [0, 0, 255, 255], first: [255, 255, 255, 255] };

/**
 * An image whose colours alpha does not multiply: in WebKitGTK it always multiplies those of an ImageBitmap.
 * @param {Blob} blob
 * @param {boolean} alpha
 */
async function decoded(blob, alpha) {
  if (!alpha) return createImageBitmap(blob, { colorSpaceConversion: "none" });
  const src = URL.createObjectURL(blob), image = Object.assign(new Image(), { src });
  await image.decode().finally(() => URL.revokeObjectURL(src));
  return image;
}

/**
 * The bytes of a file, checked. Throws if it is another.
 * @param {Uint8Array<ArrayBuffer>} body
 * @param {SetIndex} index
 * @param {Part} part
 */
export function checkedPart(body, { container }, { bytes, crc32 }) {
  demand(body.length === bytes && checksum(body) === crc32, "another checksum");
  return new Blob([body], { type: MEDIA[container] });
}

/**
 * The image in a file. Rejects if it cannot be decoded, or is of another size.
 * @param {Blob} blob
 * @param {SetIndex} index
 * @param {Part} part
 */
export async function imageOf(blob, { components }, { width, height }) {
  const image = await decoded(blob, components % 2 === 0);
  demand(image.width === width && image.height === height, "an image of another size");
  return image;
}

/** @typedef {Awaited<ReturnType<typeof imageOf>>} Picture */

export class Joiner {
  /** @param {WebGL2RenderingContext} gl */
  constructor(gl) {
    this.gl = gl;
    this.use = programOf(gl, "join", [QUAD, JOIN]);
    this.buffer = gl.createFramebuffer();
    this.patterns = Object.fromEntries(Object.entries(PATTERNS).map(([axis, texels]) => {
      const texture = this.#texture(2, 2, gl.R8);
      for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, name, gl.REPEAT);
      gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
      gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, 2, 2, gl.RED, gl.UNSIGNED_BYTE, new Uint8Array(texels));
      return [axis, texture];
    }));
  }

  /** A texture of four channels with the image of a file, which is closed. @param {Picture} image */
  upload(image) {
    const { gl } = this, texture = this.#texture(image.width, image.height, gl.RGBA8);
    gl.pixelStorei(gl.UNPACK_PREMULTIPLY_ALPHA_WEBGL, false);
    gl.pixelStorei(gl.UNPACK_COLORSPACE_CONVERSION_WEBGL, gl.NONE);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, gl.RGBA, gl.UNSIGNED_BYTE, image);
    if ("close" in image) image.close();
    return texture;
  }

  /**
   * The image that a file makes of the one before, which is deleted, as the file is; both are looked up nearest.
   * @param {Part} part
   * @param {WebGLTexture | null} before null for the first file
   * @param {WebGLTexture} next that of the file
   * @param {number} [channels] of the image: 4, or 1 for grey, 2 for grey and alpha
   * @param {boolean} [mips] whether it gets mip levels, and is looked up among them
   */
  join({ axis, joined: { width, height } }, before, next, channels = 4, mips = false) {
    const { gl, use: { program, at } } = this;
    const levels = mips ? 1 + Math.floor(Math.log2(Math.max(width, height))) : 1;
    const result = this.#texture(width, height, channels === 1 ? gl.R8 : channels === 2 ? gl.RG8 : gl.RGBA8, levels);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.buffer);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, result, 0);
    gl.viewport(0, 0, width, height);
    gl.disable(gl.BLEND);
    gl.useProgram(program);
    const inputs = { before: before ?? next, next, pattern: this.patterns[axis ?? "first"] };
    Object.entries(inputs).forEach(([name, texture], unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture);
      // It may have been drawn from with mip levels.
      if (texture === before) this.#filter(gl.NEAREST, gl.NEAREST);
      gl.uniform1i(at[name], unit);
    });
    gl.activeTexture(gl.TEXTURE0);
    gl.uniform2f(at.size, width, height);
    gl.uniform1i(at.pairs, +(channels === 2));
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.deleteTexture(before);
    gl.deleteTexture(next);
    if (mips) {
      gl.bindTexture(gl.TEXTURE_2D, result);
      gl.generateMipmap(gl.TEXTURE_2D);
      this.#filter(gl.LINEAR_MIPMAP_LINEAR, gl.LINEAR);
    }
    return result;
  }

  /** Texels of a texture, four bytes each, rows from the top. @param {WebGLTexture | null} texture
   * @param {number} width @param {number} height */
  texels(texture, width, height) {
    const { gl } = this, texels = new Uint8Array(4 * width * height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.buffer);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, texels);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    return texels;
  }

  /** A texture looked up nearest. @param {number} width @param {number} height @param {number} format
   * @param {number} [levels] */
  #texture(width, height, format, levels = 1) {
    const { gl } = this, texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texStorage2D(gl.TEXTURE_2D, levels, format, width, height);
    this.#filter(gl.NEAREST, gl.NEAREST);
    for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
    return texture;
  }

  /** @param {number} smaller @param {number} larger */
  #filter(smaller, larger) {
    this.gl.texParameteri(this.gl.TEXTURE_2D, this.gl.TEXTURE_MIN_FILTER, smaller);
    this.gl.texParameteri(this.gl.TEXTURE_2D, this.gl.TEXTURE_MAG_FILTER, larger);
  }
}

/** Steps of an image that a graphics card can hold. @param {WebGL2RenderingContext} gl @param {SetIndex} index */
export function mostSteps(gl, { files }) {
  const widest = gl.getParameter(gl.MAX_TEXTURE_SIZE);
  const fitting = files.findIndex(({ joined: { width, height } }) =>
    Math.max(width, height) > widest || 4 * width * height > LARGEST);
  return fitting < 0 ? files.length : fitting;
}

export class Joining {
  /** @param {WebGL2RenderingContext} gl @param {SetIndex} index
   * @param {(file: string) => string} urlOf @param {import("../../page/net/fetcher.js").Fetcher} fetcher */
  constructor(gl, index, urlOf, fetcher) {
    this.index = index;
    this.urlOf = urlOf;
    this.fetcher = fetcher;
    this.joiner = new Joiner(gl);
    /** Steps that are joined, and the image that they make. @type {WebGLTexture | null} */
    this.texture = null;
    this.steps = 0;
    this.running = false;
    /** Steps that the graphics card can hold. */
    this.most = mostSteps(gl, index);
    if (!this.most) throw new PageError("PTM-V101", objects.largeImage);
  }

  /** Size of the image so far. */
  get size() {
    return this.steps ? this.index.files[this.steps - 1].joined : { width: 0, height: 0 };
  }

  /** Fetches and joins the next file, if none is on its way. @param {(fault: unknown) => void} fail */
  advance(fail) {
    if (this.running || this.steps === this.most) return;
    this.running = true;
    this.#next().then(() => (this.running = false), fail);
  }

  async #next() {
    const { index, joiner } = this, part = index.files[this.steps];
    const image = await this.fetcher.whole(this.urlOf(part.name), (body) =>
      imageOf(checkedPart(body, index, part), index, part));
    const next = joiner.upload(image);
    this.texture = part.axis ? joiner.join(part, this.texture, next) : next;
    this.steps++;
  }

  /** The texels of the image so far, four bytes each, rows from the top. */
  texels() {
    const { width, height } = this.size;
    return this.joiner.texels(this.texture, width, height);
  }
}
