// The interlaced images of a site: their manifests, which come in one document, and their files.

import { checkedPart, checkedSet, imageOf, mostSteps } from "../forms/joining.js";
import { demand } from "../octree/octree.js";

/** @typedef {import("../forms/joining.js").Picture} Picture */
/** @typedef {import("../forms/joining.js").SetIndex} SetIndex */
/** @typedef {import("../../page/data/site.js").TextureRow} TextureRow */

/** Texels of an image and its mip levels. @param {{width: number, height: number}} size */
function withMips({ width, height }) {
  let sum = width * height;
  while (width > 1 || height > 1) {
    [width, height] = [Math.max(1, width >> 1), Math.max(1, height >> 1)];
    sum += width * height;
  }
  return sum;
}

/** The interlaced image of a texture, as far as the graphics card can hold it. */
export class TextureSet {
  /** @type {Blob[]} files that are here; a texture that shrinks is joined from them again */
  #blobs = [];
  /** The last file, until it is joined. @type {Picture | null} */
  #image = null;

  /**
   * @param {SetIndex} index
   * @param {string[]} urls of its files
   * @param {number} most steps
   * @param {number} channels of a texel on the graphics card
   */
  constructor(index, urls, most, channels) {
    this.index = index;
    this.urls = urls;
    this.channels = channels;
    this.parts = index.files.slice(0, most);
    /** Of each step, and those before: bytes of files, and of texture memory. */
    let end = 0;
    this.ends = this.parts.map(({ bytes }) => (end += bytes));
    this.memory = this.parts.map(({ joined }) => channels * withMips(joined));
  }

  /** The step whose file begins where those before it end. @param {number} begin */
  step(begin) {
    return this.ends.filter((end) => end <= begin).length;
  }

  /** Takes the file of a step. Rejects if it is damaged. @param {number} step @param {Uint8Array<ArrayBuffer>} body */
  async take(step, body) {
    const part = this.parts[step], blob = checkedPart(body, this.index, part);
    const image = await imageOf(blob, this.index, part);
    this.#drop();
    this.#image = image;
    this.#blobs[step] = blob;
  }

  /** The image in the file of a step, for its receiver to close. @param {number} step @returns {Promise<Picture>} */
  async image(step) {
    const image = this.#image;
    if (image && step === this.#blobs.length - 1) {
      this.#image = null;
      return image;
    }
    return imageOf(this.#blobs[step], this.index, this.parts[step]);
  }

  #drop() {
    if (this.#image && "close" in this.#image) this.#image.close();
    this.#image = null;
  }
}

/**
 * The sets of a document for the textures of an index. Throws if they do not match.
 * @param {any} document
 * @param {TextureRow[]} rows
 * @param {(file: string) => string} urlOf
 * @param {WebGL2RenderingContext} gl
 */
export function setsIn(document, rows, urlOf, gl) {
  demand(document?.format === "ptmtools interlaced images" && document.schema === 1, "not a document of interlaced images");
  demand(Array.isArray(document.sets) && document.sets.length === rows.length, "other textures");
  return rows.map((row, t) => {
    const { manifest, files } = document.sets[t] ?? {}, index = checkedSet(manifest);
    demand(index.components === row.components, "another texture");
    demand(Array.isArray(files) && files.length === index.files.length, "files without names");
    const most = mostSteps(gl, index);
    demand(most > 0, "an image larger than this graphics card's textures");
    return new TextureSet(index, files.map((/** @type {unknown} */ file) => urlOf(String(file))), most, row.gpuTexelBytes);
  });
}

/** The row of a texture whose columns are the steps of its set. @param {TextureRow} row @param {TextureSet} set @returns {TextureRow} */
export function rowOf(row, { ends, parts }) {
  const { width, height } = parts[parts.length - 1].joined;
  return { ...row, width, height, ends, differences: ends.map(() => 0), previews: [], offsets: undefined };
}
