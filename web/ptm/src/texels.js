// Texels as numbers of 32 bits, component c in bits 8 c to 8 c + 7. With three components the upper
// byte is opaque alpha, so that most texels are ready for upload as they are; with fewer the upper
// bytes are zero. Conversions from stored bytes and to the requested format.

import { damaged } from "./errors.js";
import { Reader } from "./reader.js";

/** Alpha above three components. */
const OPAQUE = 0xff << 24;
const GREY = 0x010101;

/**
 * @typedef {object} Shape
 * @property {number} width texels
 * @property {number} height
 * @property {number} components
 */

/**
 * Texels from `at` on, of `step` to `step`.
 * @param {Uint8Array} bytes components of a texel together
 * @param {number} components
 * @param {Uint32Array} out
 * @param {number} at
 * @param {number} step
 */
function pack(bytes, components, out, at, step) {
  for (let i = 0; i < bytes.length; at += step) {
    let texel = (components === 3 ? OPAQUE : 0) | bytes[i++];
    for (let shift = 8; shift < 8 * components; shift += 8) texel |= bytes[i++] << shift;
    out[at] = texel;
  }
}

/**
 * A level that is stored uncompressed.
 * @param {Uint8Array} data
 * @param {Shape} shape
 */
export function storedTexels(data, { width, height, components }) {
  const reader = new Reader(data);
  const bytes = reader.take(width * height * components);
  reader.end();
  const out = new Uint32Array(width * height);
  pack(bytes, components, out, 0, 1);
  return out;
}

/**
 * A level as profile `raw` codes it: two bits for each sample below, then all texels but the lower
 * right ones of the blocks (paper, Eq. 3).
 * @param {Uint8Array} data
 * @param {Uint32Array} below
 * @param {Shape} shape
 */
export function rawTexels(data, below, { width, height, components }) {
  const bw = width >> 1;
  const reader = new Reader(data);
  const pairs = reader.take(Math.ceil((below.length * components) / 4));
  const partial = reader.take((width * height - below.length) * components);
  reader.end();
  const out = new Uint32Array(width * height);
  let from = 0;
  for (let y = 0; y < height; y++) {
    const whole = !(y & 1);
    const size = (whole ? width : width - bw) * components;
    pack(partial.subarray(from, from + size), components, out, y * width, whole ? 1 : 2);
    from += size;
  }
  for (let block = 0, pair = 0; block < below.length; block++) {
    const at = 2 * Math.floor(block / bw) * width + 2 * (block % bw);
    const [p, q, r] = [out[at], out[at + 1], out[at + width]];
    let s = components === 3 ? OPAQUE : 0;
    for (let shift = 0; shift < 8 * components; shift += 8, pair++) {
      const remainder = (pairs[pair >> 2] >> (2 * (pair & 3))) & 3;
      const others = (p >>> shift) + (q >>> shift) + (r >>> shift);
      s |= ((4 * (below[block] >>> shift) + remainder - others) & 255) << shift;
    }
    out[at + width + 1] = s;
  }
  return out;
}

/**
 * The texels of an array that has a buffer of its own, not copied.
 * @param {Uint32Array} texels
 */
export function asBytes(texels) {
  return new Uint8Array(/** @type {ArrayBuffer} */ (texels.buffer));
}

/**
 * Texels ready for upload: red, green, blue, alpha; grey is in all three, missing alpha is 255.
 * @param {Uint32Array} texels
 * @param {number} components
 */
export function toRgba(texels, components) {
  if (components > 2) return new Uint8Array(texels.slice().buffer);
  // Signed numbers: engines do not store unsigned ones of 32 bits as small integers.
  const from = new Int32Array(texels.buffer, texels.byteOffset, texels.length);
  const out = new Int32Array(texels.length);
  for (let i = 0; i < out.length; i++) {
    const alpha = components === 2 ? (from[i] & 0xff00) << 16 : OPAQUE;
    out[i] = Math.imul(from[i] & 255, GREY) | alpha;
  }
  return new Uint8Array(out.buffer);
}

/**
 * The components unchanged, interleaved by texel.
 * @param {Uint32Array} texels
 * @param {number} components
 */
export function toNative(texels, components) {
  if (components === 4) return new Uint8Array(texels.slice().buffer);
  const out = new Uint8Array(texels.length * components);
  for (let i = 0, at = 0; i < texels.length; i++) {
    const texel = texels[i];
    out[at++] = texel;
    if (components > 1) out[at++] = texel >> 8;
    if (components > 2) out[at++] = texel >> 16;
  }
  return out;
}

/** @param {number} coder */
export function unknownCoder(coder) {
  const old = coder > 0 && coder < 4 ? " (of version 1)" : "";
  return damaged(`coder ${coder}${old} is not known here`);
}
