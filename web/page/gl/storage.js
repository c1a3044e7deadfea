// A texture on the GPU with its coarsest levels, up to one, and no room for finer ones: storage of the
// whole pyramid would take all of its memory at once, and no level of it can be freed. So growing and
// shrinking mean another storage.

import { withOffset } from "../../client/src/levels.js";
import { isCard } from "./context.js";

/** Bytes of one upload: a stripe of this size blocks for 7 ms at most, a whole level of 2048² for 137. */
export const STRIPE = 256 << 10;
/** Seconds in which a new level fades in. */
const FADE = 0.3;
/** Texels along the line of sight that a graphics card averages where a surface is seen from the side. */
const ANISOTROPY = 4;
/** TEXTURE_MAX_ANISOTROPY_EXT. */
const MAX_ANISOTROPY = 0x84fe;

/**
 * Formats by channels on the GPU, which has no texels of three bytes.
 * @param {WebGL2RenderingContext} gl
 * @param {number} channels
 */
function formats(gl, channels) {
  if (channels === 1) return { inside: gl.R8, outside: gl.RED };
  if (channels === 2) return { inside: gl.RG8, outside: gl.RG };
  return { inside: gl.RGBA8, outside: gl.RGBA };
}

export class Storage {
  /** Levels that are to fade in, and how many are left of them now. */
  #fading = 0;
  left = 0;
  #since = 0;
  #wrap = -1;

  /**
   * @param {WebGL2RenderingContext} gl
   * @param {{width: number, height: number}[]} sizes of the levels held, coarsest first
   * @param {number} channels 1, 2 or 4
   */
  constructor(gl, sizes, channels) {
    this.gl = gl;
    this.sizes = sizes;
    this.channels = channels;
    this.texture = gl.createTexture();
    this.bytes = sizes.reduce((sum, { width, height }) => sum + width * height * channels, 0);
    const { width, height } = sizes[sizes.length - 1];
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.texStorage2D(gl.TEXTURE_2D, sizes.length, formats(gl, channels).inside, width, height);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.LINEAR);
  }

  get levels() {
    return this.sizes.length;
  }

  /**
   * Uploads the next stripe of a level; the row behind it.
   * @param {number} level
   * @param {Uint8Array} data all of the level
   * @param {number} row
   * @param {number} offset of the level
   */
  upload(level, data, row, offset) {
    const { gl, channels } = this, { width, height } = this.sizes[level];
    const rows = Math.min(height - row, Math.max(1, Math.floor(STRIPE / (width * channels))));
    const stripe = data.subarray(row * width * channels, (row + rows) * width * channels);
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.texSubImage2D(
      gl.TEXTURE_2D, this.levels - 1 - level, 0, row, width, rows,
      formats(gl, channels).outside, gl.UNSIGNED_BYTE, withOffset(stripe, channels, offset),
    );
    return row + rows;
  }

  /**
   * Fades in the levels beyond those shown before.
   * @param {number} levels
   * @param {number} now s
   */
  fadeIn(levels, now) {
    this.#fading = levels;
    this.#since = now;
  }

  /**
   * Binds the texture for drawing; true as long as it fades.
   * @param {boolean} clampU
   * @param {boolean} clampV
   * @param {number} now s
   * @param {boolean} [atlas] whether it has parts that do not belong together
   */
  bind(clampU, clampV, now, atlas) {
    const { gl } = this, wrap = +clampU + 2 * +clampV;
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    if (wrap !== this.#wrap) {
      const [s, t] = [clampU, clampV].map((clamp) => (clamp ? gl.CLAMP_TO_EDGE : gl.REPEAT));
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, s);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, t);
      this.#wrap = wrap;
      if (!atlas && isCard(gl) && gl.getExtension("EXT_texture_filter_anisotropic")) {
        gl.texParameterf(gl.TEXTURE_2D, MAX_ANISOTROPY, ANISOTROPY);
      }
    }
    if (!this.#fading) return false;
    const left = this.left = this.#fading * Math.max(0, 1 - (now - this.#since) / FADE);
    gl.texParameterf(gl.TEXTURE_2D, gl.TEXTURE_MIN_LOD, left || -1000);
    if (!left) this.#fading = 0;
    return left > 0;
  }

  delete() {
    this.gl.deleteTexture(this.texture);
  }
}
