// Joins the files of an interlaced image on the graphics card, step by step, by drawing alternately into
// two textures (docs/formats/interlace.md; Englert et al., section 3.2).

import { programOf } from "../gl/program.js";
import { PageError } from "../net/errors.js";
import { checksum } from "../octree/checksum.js";
import { demand, isWhole } from "../octree/octree.js";

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

/** The step of the paper (Eq. 1). */
const JOIN = `#version 300 es
precision highp float;
precision highp sampler2D;
uniform sampler2D before, next, pattern;
uniform vec2 size;
out vec4 texel;
void main() {
  vec2 place = gl_FragCoord.xy / size;
  texel = texture(pattern, place * size / 2.0).r == 0.0 ? texture(before, place) : texture(next, place);
}`;

/** Texels that decide between the image so far and the next file; 2 × 2, repeated. */
const PATTERNS = { columns: [0, 255, 0, 255], rows: [0, 0, 255, 255] };

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

export class Joining {
  /** @param {WebGL2RenderingContext} gl @param {SetIndex} index
   * @param {(file: string) => string} urlOf @param {import("../net/fetcher.js").Fetcher} fetcher */
  constructor(gl, index, urlOf, fetcher) {
    this.gl = gl;
    this.index = index;
    this.urlOf = urlOf;
    this.fetcher = fetcher;
    this.use = programOf(gl, "join", [QUAD, JOIN]);
    this.buffer = gl.createFramebuffer();
    this.patterns = Object.fromEntries(Object.entries(PATTERNS).map(([axis, texels]) => {
      const texture = this.#texture(2, 2, gl.R8, gl.REPEAT);
      gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
      gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, 2, 2, gl.RED, gl.UNSIGNED_BYTE, new Uint8Array(texels));
      return [axis, texture];
    }));
    /** Steps that are joined, and the image that they make. @type {WebGLTexture | null} */
    this.texture = null;
    this.steps = 0;
    this.running = false;
    const widest = gl.getParameter(gl.MAX_TEXTURE_SIZE);
    const fitting = index.files.findIndex(({ joined: { width, height } }) =>
      Math.max(width, height) > widest || 4 * width * height > LARGEST);
    /** Steps that the graphics card can hold. */
    this.most = fitting < 0 ? index.files.length : fitting;
    if (!this.most) throw new PageError("PTM-V101", "The image is larger than this graphics card's textures.");
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
    const { gl } = this, part = this.index.files[this.steps];
    const image = await this.fetcher.whole(this.urlOf(part.name), async (body) => {
      demand(body.length === part.bytes && checksum(body) === part.crc32, "another checksum");
      const blob = new Blob([body], { type: MEDIA[this.index.container] });
      const image = await decoded(blob, this.index.components % 2 === 0);
      demand(image.width === part.width && image.height === part.height, "an image of another size");
      return image;
    });
    const next = this.#texture(part.width, part.height, gl.RGBA8, gl.CLAMP_TO_EDGE);
    gl.pixelStorei(gl.UNPACK_PREMULTIPLY_ALPHA_WEBGL, false);
    gl.pixelStorei(gl.UNPACK_COLORSPACE_CONVERSION_WEBGL, gl.NONE);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, gl.RGBA, gl.UNSIGNED_BYTE, image);
    if ("close" in image) image.close();
    if (part.axis) {
      const joined = this.#joined(part, next);
      gl.deleteTexture(this.texture);
      gl.deleteTexture(next);
      this.texture = joined;
    } else {
      this.texture = next;
    }
    this.steps++;
  }

  /** @param {Part} part @param {WebGLTexture} next */
  #joined({ axis, joined: { width, height } }, next) {
    const { gl, use: { program, at } } = this;
    const result = this.#texture(width, height, gl.RGBA8, gl.CLAMP_TO_EDGE);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.buffer);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, result, 0);
    gl.viewport(0, 0, width, height);
    gl.disable(gl.BLEND);
    gl.useProgram(program);
    const inputs = { before: this.texture, next, pattern: this.patterns[/** @type {string} */ (axis)] };
    Object.entries(inputs).forEach(([name, texture], unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.uniform1i(at[name], unit);
    });
    gl.uniform2f(at.size, width, height);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    return result;
  }

  /** The texels of the image so far, four bytes each, rows from the top. */
  texels() {
    const { gl } = this, { width, height } = this.size, texels = new Uint8Array(4 * width * height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.buffer);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.texture, 0);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, texels);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    return texels;
  }

  /** A texture looked up nearest. @param {number} width @param {number} height @param {number} format
   * @param {number} wrap */
  #texture(width, height, format, wrap) {
    const { gl } = this, texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, format, width, height);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
    for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, name, wrap);
    return texture;
  }
}
