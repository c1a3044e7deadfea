// Textures of a given size in all, to measure how long the graphics card takes to draw from them. They
// have a context of their own, so that the pictures of the page stay as they are.

import { programOf } from "./program.js";

/** Texels of a side, and bytes of a texture. */
const SIDE = 1024, EACH = 4 * SIDE * SIDE;
/** Pixels of a side of a picture: one in each 4 KiB of a texture, the size of a page of memory. */
const PIXELS = 32;
/** Pictures of which the fastest counts, and textures that are uploaded between two frames. */
const TIMES = 3, UPLOADS = 4;

const SOURCES = [`#version 300 es
out vec2 at;
void main() {
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0;
  at = corner;
  gl_Position = vec4(corner * 2.0 - 1.0, 0, 1);
}`, `#version 300 es
precision mediump float;
uniform sampler2D texels;
in vec2 at;
out vec4 color;
void main() {
  color = texture(texels, at);
}`];

/** The next frame of the page. */
export const frame = () => new Promise((done) => requestAnimationFrame(done));

export class Load {
  /** @type {WebGLTexture[]} */
  #textures = [];
  #texels = new Uint8Array(EACH);

  /** Throws an Error without another context. */
  constructor() {
    const canvas = Object.assign(document.createElement("canvas"), { width: PIXELS, height: PIXELS });
    const gl = canvas.getContext("webgl2", { antialias: false });
    if (!gl) throw new Error("no context");
    this.gl = gl;
    gl.useProgram(programOf(gl, "load", SOURCES).program);
  }

  /**
   * Seconds of a picture from textures of that size; Infinity if there is no memory for them.
   * @param {number} bytes
   */
  async seconds(bytes) {
    const { gl } = this, count = Math.ceil(bytes / EACH);
    for (const texture of this.#textures.splice(count)) gl.deleteTexture(texture);
    while (this.#textures.length < count) {
      this.#textures.push(this.#upload());
      if (this.#textures.length % UPLOADS === 0) await frame();
      if (gl.getError() !== gl.NO_ERROR) return Infinity;
    }
    let least = this.#draw();
    for (let k = 1; k < TIMES; k++) least = Math.min(least, this.#draw());
    return gl.isContextLost() ? Infinity : least;
  }

  #upload() {
    const { gl } = this, texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA8, SIDE, SIDE);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, SIDE, SIDE, gl.RGBA, gl.UNSIGNED_BYTE, this.#texels);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    return texture;
  }

  /** Draws from each texture, and waits for it; s. */
  #draw() {
    const { gl } = this, pixel = new Uint8Array(4);
    const begin = performance.now();
    for (const texture of this.#textures) {
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.drawArrays(gl.TRIANGLES, 0, 3);
    }
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    return (performance.now() - begin) / 1000;
  }

  /** Frees all of it. */
  delete() {
    for (const texture of this.#textures) this.gl.deleteTexture(texture);
    this.gl.getExtension("WEBGL_lose_context")?.loseContext();
  }
}
