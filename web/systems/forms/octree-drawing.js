// Draws a simplified mesh with the normals of its octree: the traversal in the fragment shader
// (docs/formats/apo.md, "Looking a normal up"; Lacoste et al., section 3.2), lit as by `ptm render`.

import { programOf } from "../../page/gl/program.js";
import { LOOK_UP } from "../octree/look-up.js";
import { checksum } from "../octree/checksum.js";
import { demand, isWhole } from "../octree/octree.js";

/** Shares of white light: ambient, from the upper left, and from the lower right. */
const AMBIENT = 0.2, KEY = 0.7, FILL = 0.2;
/** Directions of the lights, right, up and towards the camera; colour of a surface without one. */
const KEY_FROM = [-0.5, 0.65, 0.6], FILL_FROM = [0.8, -0.3, 0.5], STONE = [0.93, 0.9, 0.85];
const BACKGROUND = [58, 62, 70].map((part) => part / 255);

const VERTEX = `#version 300 es
in vec3 corner;
in vec3 own;
uniform vec3 eye, right, up, ahead;
uniform vec2 lens;
uniform float near;
out highp vec3 q;
out highp vec3 normal;
void main() {
  vec3 p = corner - eye;
  float z = dot(p, ahead);
  q = corner;
  normal = own;
  gl_Position = vec4(dot(p, right) / lens.x, dot(p, up) / lens.y, z - 2.0 * near, z);
}`;

const FRAGMENT = `#version 300 es
precision highp float;
precision highp int;
precision highp usampler2D;
in highp vec3 q;
in highp vec3 normal;
uniform usampler2D colors;
uniform bool colored, bare;
uniform vec3 key, fill, stone;
out vec4 shown;

${LOOK_UP}
void main() {
  int stop = stopDepth(q);
  vec3 n = normal;
  vec3 color = stone;
  if (deepest >= 0) {
    int address = addressAt(q, stop);
    n = vec3(texel(octree, address).rgb) / 127.5 - 1.0;
    if (colored) color = vec3(texel(colors, address).rgb) / 255.0;
  }
  n = normalize(n);
  float light = ${AMBIENT} + ${KEY} * max(dot(n, key), 0.0) + ${FILL} * max(dot(n, fill), 0.0);
  shown = vec4(bare ? n * 0.5 + 0.5 : min(color * light, 1.0), 1.0);
}`;

/** @typedef {{positions: Float32Array, normals: Float32Array, indices: Uint16Array | Uint32Array,
 *   low: number[], high: number[]}} Mesh */

/**
 * The mesh of a GLB that `ptm apo` wrote: positions, normals, indices, in this order.
 * @param {Uint8Array<ArrayBuffer>} body
 * @param {number} crc its CRC-32
 * @returns {Mesh}
 */
export function meshOf(body, crc) {
  demand(checksum(body) === crc, "another checksum");
  const view = new DataView(body.buffer, body.byteOffset, body.length);
  demand(body.length >= 28 && view.getUint32(0, true) === 0x46546c67, "not a GLB");
  const length = view.getUint32(12, true), from = 20 + length + 8;
  demand(from <= body.length, "a chunk that leads out of the file");
  const { bufferViews, accessors } = JSON.parse(new TextDecoder().decode(body.subarray(20, 20 + length)));
  const binary = body.slice(from);
  /** @param {number} k @param {typeof Float32Array | typeof Uint16Array | typeof Uint32Array} Kind
   * @param {number} items */
  const array = (k, Kind, items) => {
    const count = accessors[k].count * items, begin = bufferViews[k].byteOffset ?? 0;
    demand(isWhole(count, 1, 2 ** 31) && isWhole(begin, 0, binary.length), "an impossible accessor");
    demand(begin + count * Kind.BYTES_PER_ELEMENT <= binary.length, "an accessor that leads out of its bytes");
    return new Kind(binary.buffer, begin, count);
  };
  const positions = /** @type {Float32Array} */ (array(0, Float32Array, 3));
  const normals = /** @type {Float32Array} */ (array(1, Float32Array, 3));
  const Kind = /** @type {Record<number, any>} */ ({ 5123: Uint16Array, 5125: Uint32Array })[accessors[2].componentType];
  demand(Kind && normals.length === positions.length, "arrays that do not match");
  const indices = /** @type {Uint16Array | Uint32Array} */ (array(2, Kind, 1));
  demand(positions.every(Number.isFinite) && normals.every(Number.isFinite), "a number that is not finite");
  demand(indices.every((index) => index < positions.length / 3), "an index out of range");
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  positions.forEach((x, at) => {
    low[at % 3] = Math.min(low[at % 3], x);
    high[at % 3] = Math.max(high[at % 3], x);
  });
  return { positions, normals, indices, low, high };
}

/** The mesh on the graphics card, in the coordinates of the cube. */
export class OctreeDrawing {
  /**
   * @param {WebGL2RenderingContext} gl
   * @param {Mesh} mesh
   * @param {{low: number[], side: number}} cube
   */
  constructor(gl, { positions, normals, indices, low, high }, { low: corner, side }) {
    this.gl = gl;
    this.use = programOf(gl, "octree", [VERTEX, FRAGMENT]);
    this.cube = { corner, side };
    this.radius = Math.hypot(...high.map((x, k) => x - low[k])) / side / 2;
    this.count = indices.length;
    this.type = indices instanceof Uint16Array ? gl.UNSIGNED_SHORT : gl.UNSIGNED_INT;
    this.array = gl.createVertexArray();
    gl.bindVertexArray(this.array);
    const inside = positions.map((x, at) => (x - corner[at % 3]) / side);
    for (const [name, data] of /** @type {[string, Float32Array][]} */ ([["corner", inside], ["own", normals]])) {
      const place = gl.getAttribLocation(this.use.program, name);
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 0, 0);
    }
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
  }

  /**
   * @param {import("../octree/octree.js").Octree} octree
   * @param {import("./orbit.js").Orbit["camera"]} camera
   * @param {{bare: boolean, levels: number}} look normals as colours; the most levels that are shown
   */
  draw(octree, camera, { bare, levels }) {
    const { gl, use: { program, at }, cube: { corner, side } } = this;
    const { right, up, ahead, half } = camera, away = camera.away / side;
    gl.viewport(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight);
    const [red, green, blue] = bare ? [0, 0, 0] : BACKGROUND;
    gl.clearColor(red, green, blue, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.useProgram(program);
    gl.bindVertexArray(this.array);
    octree.texels.forEach(({ texture }, unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture);
    });
    const deepest = Math.min(octree.levels, levels) - 1, colored = octree.texels.length > 1;
    gl.uniform1i(at.octree, 0);
    gl.uniform1i(at.colors, colored ? 1 : 0);
    gl.uniform1i(at.texels, octree.count);
    gl.uniform1i(at.deepest, deepest);
    gl.uniform1i(at.partial, Number(octree.partial && octree.levels < levels));
    gl.uniform1i(at.colored, Number(colored));
    gl.uniform1i(at.bare, Number(bare));
    gl.uniform3fv(at.eye, camera.eye.map((x, k) => (x - corner[k]) / side));
    for (const [name, axis] of Object.entries({ right, up, ahead })) gl.uniform3fv(at[name], axis);
    gl.uniform2fv(at.lens, half);
    gl.uniform1f(at.near, Math.max(away - this.radius, away / 64) / 2);
    for (const [name, from] of Object.entries({ key: KEY_FROM, fill: FILL_FROM })) {
      const light = right.map((_, k) => from[0] * right[k] + from[1] * up[k] - from[2] * ahead[k]);
      gl.uniform3fv(at[name], light.map((x) => x / Math.hypot(...light)));
    }
    gl.uniform3fv(at.stone, STONE);
    gl.drawElements(gl.TRIANGLES, this.count, this.type, 0);
  }

  /** Pixels of the nearest node of a depth, at most. @param {number} depth @param {number} height of
   * the canvas @param {import("./orbit.js").Orbit["camera"]} camera */
  pixels(depth, height, camera) {
    const near = Math.max(camera.away / this.cube.side - this.radius, 1e-6);
    return (height / (2 * camera.half[1] * near)) * 2 ** -depth;
  }
}
