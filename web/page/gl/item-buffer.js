// The item buffer: a small picture of the visible textures, lightmaps and levels of detail, read back
// without waiting, and a second one of placeholders for missing cells.

import { ITEM_PIXELS } from "../policy/constants.js";
import { Fence } from "./fence.js";
import { aim, programOf } from "./program.js";
import { ITEMS, PLACEHOLDERS } from "./shaders.js";

/** @typedef {import("./camera.js").Camera} Camera */

/**
 * @typedef {object} Reading
 * @property {number} pixels
 * @property {Uint16Array} items two numbers a pixel: pair + 1, level of detail · 256
 * @property {number[][]} pairs textures, lightmaps and probes that are seen together, -1 for none
 * @property {Uint16Array | null} placeholders the first is the cell + 1; null if none were drawn
 * @property {number} drawn when, s
 */

export class ItemBuffer {
  /** Whether placeholders were drawn, and when it was drawn, s. */
  #second = false;
  #drawn = 0;
  /** @type {number[][]} */
  #pairs = [];
  #width = 0;
  #height = 0;
  #frame;
  #depth;
  #colors;
  #packs;
  #boxes;
  #boxArray;

  /** @param {WebGL2RenderingContext} gl */
  constructor(gl) {
    this.gl = gl;
    this.fence = new Fence(gl);
    this.item = programOf(gl, "item", ITEMS);
    this.placeholder = programOf(gl, "placeholder", PLACEHOLDERS);
    this.#frame = gl.createFramebuffer();
    this.#depth = gl.createRenderbuffer();
    this.#colors = [gl.createRenderbuffer(), gl.createRenderbuffer()];
    this.#packs = [gl.createBuffer(), gl.createBuffer()];
    this.#boxes = gl.createBuffer();
    this.#boxArray = gl.createVertexArray();
    gl.bindVertexArray(this.#boxArray);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#boxes);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 12, 0);
    gl.bindVertexArray(null);
  }

  /** Whether an item buffer was drawn and not read yet. */
  get busy() {
    return this.fence.busy;
  }

  /** @param {number} aspect */
  #resize(aspect) {
    const { gl } = this;
    const height = Math.max(1, Math.round(Math.sqrt(ITEM_PIXELS / aspect)));
    const width = Math.max(1, Math.round(ITEM_PIXELS / height));
    if (width === this.#width && height === this.#height) return;
    this.#width = width;
    this.#height = height;
    gl.bindRenderbuffer(gl.RENDERBUFFER, this.#depth);
    gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT24, width, height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.#frame);
    gl.framebufferRenderbuffer(
      gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, this.#depth,
    );
    this.#colors.forEach((color, k) => {
      const at = gl.COLOR_ATTACHMENT0 + k;
      gl.bindRenderbuffer(gl.RENDERBUFFER, color);
      gl.renderbufferStorage(gl.RENDERBUFFER, gl.RGBA8, width, height);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, at, gl.RENDERBUFFER, color);
      gl.bindBuffer(gl.PIXEL_PACK_BUFFER, this.#packs[k]);
      // Chromium warns if a buffer that is to be read is written again, read or not.
      gl.bufferData(gl.PIXEL_PACK_BUFFER, 4 * width * height, gl.DYNAMIC_COPY);
    });
    gl.bindBuffer(gl.PIXEL_PACK_BUFFER, null);
  }

  /**
   * @param {Camera} camera
   * @param {import("../walk/picture.js").Picture} picture
   * @param {import("./viewport.js").Viewport} viewport
   * @param {import("../data/site.js").TextureRow[]} rows of the textures
   * @param {number} now s
   * @param {((camera: Camera) => void) | null} probe tests more against the depth of the surfaces
   */
  draw(camera, { drawn, missing }, { aspect, lines }, rows, now, probe) {
    const { gl, item } = this;
    this.#resize(aspect);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.#frame);
    gl.drawBuffers([gl.COLOR_ATTACHMENT0, gl.NONE]);
    gl.viewport(0, 0, this.#width, this.#height);
    gl.disable(gl.BLEND);
    gl.disable(gl.DITHER);
    gl.enable(gl.DEPTH_TEST);
    gl.depthMask(true);
    gl.clearBufferfv(gl.COLOR, 0, [0, 0, 0, 0]);
    gl.clearBufferfv(gl.DEPTH, 0, [1]);
    aim(gl, item, camera);
    gl.uniform1f(item.at.pixels, lines / this.#height);
    /** @type {Map<string, number>} */
    const items = new Map();
    this.#pairs = [];
    for (const { buffers, batches } of drawn) {
      gl.bindVertexArray(buffers.vertexArray);
      for (const batch of batches) {
        const { texture, light, probe, blends, twoSided } = batch.look, pair = [texture, light, probe], key = pair.join();
        if (!items.has(key)) items.set(key, this.#pairs.push(pair));
        if (blends && texture < 0) continue;
        gl[twoSided ? "disable" : "enable"](gl.CULL_FACE);
        gl.uniform1f(item.at.item, /** @type {number} */ (items.get(key)));
        const { width, height } = rows[texture] ?? { width: 1, height: 1 };
        gl.uniform2f(item.at.size, width, height);
        buffers.draw(batch);
      }
    }
    probe?.(camera);
    if (missing.length) this.#drawPlaceholders(camera, missing);
    this.#read(0);
    if (missing.length) this.#read(1);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.bindVertexArray(null);
    this.#second = missing.length > 0;
    this.#drawn = now;
    this.fence.mark(now);
  }

  /**
   * The far faces of the boxes of cells, which are rooms, behind the surfaces drawn so far.
   * @param {Camera} camera
   * @param {{cell: number, box: number[]}[]} missing
   */
  #drawPlaceholders(camera, missing) {
    const { gl, placeholder } = this;
    gl.drawBuffers([gl.NONE, gl.COLOR_ATTACHMENT1]);
    gl.clearBufferfv(gl.COLOR, 1, [0, 0, 0, 0]);
    aim(gl, placeholder, camera);
    gl.bindVertexArray(this.#boxArray);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#boxes);
    const corners = new Float32Array(missing.flatMap(({ box }) => faces(box)));
    gl.bufferData(gl.ARRAY_BUFFER, corners, gl.STREAM_DRAW);
    gl.enable(gl.CULL_FACE);
    gl.cullFace(gl.FRONT);
    missing.forEach(({ cell }, k) => {
      gl.uniform1f(placeholder.at.item, cell + 1);
      gl.drawArrays(gl.TRIANGLES, 36 * k, 36);
    });
    gl.cullFace(gl.BACK);
  }

  /** @param {number} k */
  #read(k) {
    const { gl } = this;
    gl.readBuffer(gl.COLOR_ATTACHMENT0 + k);
    gl.bindBuffer(gl.PIXEL_PACK_BUFFER, this.#packs[k]);
    gl.readPixels(0, 0, this.#width, this.#height, gl.RGBA, gl.UNSIGNED_BYTE, 0);
    gl.bindBuffer(gl.PIXEL_PACK_BUFFER, null);
  }

  /**
   * The item buffer drawn last, once it can be read without waiting.
   * @param {number} now s
   * @returns {Reading | null}
   */
  poll(now) {
    if (!this.fence.reached(now)) return null;
    const { gl } = this;
    const pixels = this.#width * this.#height;
    const read = [0, 1].slice(0, this.#second ? 2 : 1).map((k) => {
      const numbers = new Uint16Array(2 * pixels);
      gl.bindBuffer(gl.PIXEL_PACK_BUFFER, this.#packs[k]);
      gl.getBufferSubData(gl.PIXEL_PACK_BUFFER, 0, numbers);
      return numbers;
    });
    gl.bindBuffer(gl.PIXEL_PACK_BUFFER, null);
    return { pixels, items: read[0], pairs: this.#pairs, placeholders: read[1] ?? null, drawn: this.#drawn };
  }
}

/** Corners of a box, where bit k selects the greater end of axis k; its faces, seen from outside. */
const FACES = [
  [0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6],
];

/**
 * The triangles of a box, counter-clockwise seen from outside.
 * @param {number[]} box least and greatest x, y, z
 */
function faces(box) {
  return FACES.flatMap(([a, b, c, d]) =>
    [a, b, c, a, c, d].flatMap((corner) => [0, 1, 2].map((k) => box[k + 3 * ((corner >> k) & 1)])),
  );
}
