// Decodes an ordinary image (WebP, AVIF, JPEG) of one level by means of the browser, and halves it to
// the levels below, as the exact levels are: so both fill the same storage.
//
// The canvas of two dimensions keeps colours multiplied by alpha, and forgets those under alpha 0, which
// filtering then mixes into the edges as black. So images with alpha are read back through WebGL, which is
// slower without a graphics card. Halving takes less than decoding, so it needs no WebAssembly.

import { PtmError } from "./errors.js";

/** @typedef {import("./level-decoder.js").Image} Image */

/**
 * @typedef {object} PreviewOptions
 * @property {{width: number, height: number}[]} sizes of the levels up to that of the image, coarsest
 *   first
 * @property {number} levels that are wanted, coarsest first
 * @property {number} components of the texture: 1 or 2, which come out as they are, 3 or 4 as "rgba"
 */

/** Media types by the first byte of RIFF and of JPEG. @type {Record<number, string>} */
const TYPES = { 0x52: "image/webp", 0xff: "image/jpeg" };
/** The context in which images with alpha are read. @type {WebGL2RenderingContext | null | undefined} */
let reader;

/**
 * The first levels of an image. Throws PtmError PTM-I105 if the browser cannot decode it, or if it is of
 * another size.
 * @param {Uint8Array<ArrayBuffer>} bytes
 * @param {PreviewOptions} options
 * @returns {Promise<Image[]>}
 */
export async function decodePreview(bytes, { sizes, levels, components }) {
  const { width, height } = sizes[sizes.length - 1], type = TYPES[bytes[0]] ?? "image/avif";
  const bitmap = await createImageBitmap(new Blob([bytes], { type }), {
    premultiplyAlpha: "none", colorSpaceConversion: "none",
  }).catch(() => {
    throw new PtmError("PTM-I105", `this browser cannot decode its ${type}`);
  });
  try {
    if (bitmap.width !== width || bitmap.height !== height) {
      throw new PtmError("PTM-I105", `${bitmap.width} × ${bitmap.height} texels, not ${width} × ${height}`);
    }
    const alpha = components % 2 === 0;
    let texels = (alpha && straight(bitmap)) || opaque(bitmap);
    /** @type {Image[]} */
    const images = [];
    for (let level = sizes.length - 1; level >= 0; level--) {
      if (level < sizes.length - 1) texels = halved(texels, sizes[level + 1], sizes[level]);
      if (level >= levels) continue;
      const data = components < 3 ? narrowed(texels, components) : new Uint8Array(texels.buffer);
      images.unshift({ level, ...sizes[level], channels: components < 3 ? components : 4, data });
    }
    return images;
  } finally {
    bitmap.close();
  }
}

/** @returns {OffscreenCanvas} or a canvas of the document, in browsers without */
function canvasOf(/** @type {number} */ width, /** @type {number} */ height) {
  if (typeof OffscreenCanvas === "function") return new OffscreenCanvas(width, height);
  const canvas = Object.assign(document.createElement("canvas"), { width, height });
  return /** @type {OffscreenCanvas} */ (/** @type {unknown} */ (canvas));
}

/** The texels, as one number each. @param {ImageBitmap} bitmap */
function opaque(bitmap) {
  const { width, height } = bitmap;
  const paint = canvasOf(width, height).getContext("2d", { willReadFrequently: true });
  if (!paint) throw new Error("no canvas");
  paint.drawImage(bitmap, 0, 0);
  return new Uint32Array(paint.getImageData(0, 0, width, height).data.buffer);
}

/** The same with colours that alpha does not multiply; null without WebGL. @param {ImageBitmap} bitmap */
function straight(bitmap) {
  const { width, height } = bitmap;
  reader ??= canvasOf(1, 1).getContext("webgl2");
  if (!reader || reader.isContextLost()) return (reader = null);
  const gl = reader, texture = gl.createTexture(), frame = gl.createFramebuffer();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.pixelStorei(gl.UNPACK_COLORSPACE_CONVERSION_WEBGL, gl.NONE);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, bitmap);
  gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
  const texels = new Uint32Array(width * height);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(texels.buffer));
  const failed = gl.getError() !== gl.NO_ERROR;
  gl.deleteFramebuffer(frame);
  gl.deleteTexture(texture);
  return failed ? null : texels;
}

/**
 * The level below: means of four texels, rounded down (docs/formats/ptm.md).
 * @param {Uint32Array<ArrayBuffer>} texels
 * @param {{width: number, height: number}} from
 * @param {{width: number, height: number}} to
 */
function halved(texels, from, to) {
  const result = new Uint32Array(to.width * to.height), mask = 0xff00ff;
  const across = +(from.width > 1), down = from.height > 1 ? from.width : 0;
  for (let y = 0, k = 0; y < to.height; y++) {
    for (let x = 0, i = 2 * y * from.width; x < to.width; x++, i += 2, k++) {
      const p = texels[i], q = texels[i + across], r = texels[i + down], s = texels[i + across + down];
      const even = (p & mask) + (q & mask) + (r & mask) + (s & mask);
      const odd = ((p >>> 8) & mask) + ((q >>> 8) & mask) + ((r >>> 8) & mask) + ((s >>> 8) & mask);
      result[k] = ((even >>> 2) & mask) | (((odd >>> 2) & mask) << 8);
    }
  }
  return result;
}

/**
 * Grey, or grey and alpha.
 * @param {Uint32Array} texels
 * @param {number} components
 */
function narrowed(texels, components) {
  const data = new Uint8Array(texels.length * components);
  for (let i = 0; i < texels.length; i++) {
    data[i * components] = texels[i];
    if (components === 2) data[2 * i + 1] = texels[i] >>> 24;
  }
  return data;
}
