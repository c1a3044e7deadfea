// Objects and materials with normal maps, in the rooms of a walk: a script of its own, which sites with such
// maps load. The maps are textures, so the policies fetch them and texture memory holds them; the item buffer
// does not show them. The part of the view of an object's map follows from its box, that of a material's from
// the texture beside it. Objects are lit as octree textures are; a material's map changes its colours by the
// share by which the light on its normals differs from that on the face.

import { codeOf, lookOf } from "../gl/cell-buffers.js";
import { aim } from "../gl/program.js";
import { corners, CUT, SURFACES, TEXEL } from "../gl/shaders.js";
import { PageError } from "../net/errors.js";
import { LIT } from "./lamp.js";
import { distance } from "../space/frustum.js";
import { weigh } from "./weight.js";
import { objects } from "../words/english.js";
import { fill } from "../words/language.js";

/** What a shape has for each vertex: u, v in the normal map, from the top left; a normal; a tangent with the sign
 * of the bitangent. */
const SIZES = [2, 3, 4];
const CLAMP = 33071;
/** How an object's map is used. */
const WHOLE = { normalWrapS: CLAMP, normalWrapT: CLAMP };
/** Nearest distance of the eye that counts, m. */
const NEAREST = 0.1;

const VERTEX = corners(`
layout(location = 4) in vec2 second;
layout(location = 5) in vec3 up;
layout(location = 6) in vec4 right;
out vec2 at;
out mat3 axes;`, "at = second; axes = mat3(right.xyz, right.w * cross(up, right.xyz), up);");

const FRAGMENT = `#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec3 painted;
in vec2 at;
in mat3 axes;
uniform sampler2D relief;
out vec4 shown;
${TEXEL}
${LIT}
void main() {
  vec4 sampled = textured ? texel() : vec4(1.0);
  vec3 normal = normalize(axes * (texture(relief, at).rgb * 2.0 - 1.0));
  shown = vec4(sampled.rgb * color.rgb * painted * lit(normal), sampled.a * color.a);${CUT}
}`;

/** The surface has a uniform of that name. */
const LAMPLIGHT = LIT.replace("lit", "lamplight");
/** The axes of the map follow from the derivatives, exactly: positions are linear in it. Its y is up, v is down. */
const BUMPS = [corners(`
layout(location = 4) in vec2 second;
out vec2 at;`, "at = second;"), SURFACES[1].replace("out vec4 shown;", `out vec4 shown;
uniform mat3 turn;
uniform sampler2D relief;
uniform float scale;
in vec2 at;
${LAMPLIGHT}`).replace(/shown ?= ?vec4/, `
  vec3 a = dFdx(seen), b = dFdy(seen);
  vec2 p = dFdx(at), q = dFdy(at);
  float side = sign(p.x * q.y - p.y * q.x);
  vec3 up = normalize(cross(a, b)), right = (a * q.y - b * p.y) * side, over = (a * q.x - b * p.x) * side;
  if (dot(right, right) > 0.0) {
    vec3 tilt = texture(relief, at).rgb * 2.0 - 1.0;
    right = normalize(right);
    vec3 across = cross(up, right);
    if (dot(across, over) < 0.0) across = -across;
    vec3 normal = scale * (right * tilt.x + across * tilt.y) + up * tilt.z;
    light *= lamplight(normalize(normal) * turn) / lamplight(up * turn);
  }
  $&`)];

/** @typedef {import("../gl/cell-buffers.js").Batch} Batch */
/** @typedef {import("../gl/cell-buffers.js").CellBuffers} CellBuffers */
/** @typedef {import("../data/glb.js").Shape} Shape */
/** @typedef {{array: WebGLVertexArrayObject, buffers: WebGLBuffer[], count: number}} Part */

export class Reliefs {
  /** Of the shapes with a normal map. @type {Map<Shape, Part>} */
  #parts = new Map();
  /** Texels of the finest level to a metre, by shape. @type {WeakMap<Shape, number>} */
  #density = new WeakMap();
  /** The same of the textures beside them. @type {WeakMap<Shape, number>} */
  #own = new WeakMap();
  /** Shapes that do not fit the index. @type {WeakSet<Shape>} */
  #wrong = new WeakSet();
  #looked = false;

  /**
   * @param {import("../walkthrough.js").Walkthrough} walk
   */
  constructor(walk) {
    const { gl, picture: { renderer } } = walk;
    this.gl = gl;
    this.walk = walk;
    this.program = renderer.compile("relief", [VERTEX, FRAGMENT]);
    this.bumps = renderer.compile("bumps", BUMPS);
    const { light } = renderer;
    /** Of materials that reflect. */
    this.mirrors = light?.probes.some(Boolean) ? renderer.compile("bumps", BUMPS, true) : this.bumps;
    weigh(walk.client.catalogue, walk.index.textures);
  }

  delete() {
    for (const shape of this.#parts.keys()) this.#drop(shape);
  }

  /** Whether a look has a normal map to show. @param {Shape} look */
  has(look) {
    return this.walk.memory.held[look.relief] > 0 && this.#isSound(look);
  }

  /** Whether a shape has a normal map, and a frame for each vertex. @param {Shape} shape */
  #isSound(shape) {
    const { relief, frames, positions } = shape;
    if (relief < 0 || this.#wrong.has(shape)) return false;
    const count = positions.length / 3;
    const aligned = frames?.every((rows, k) => rows.length === SIZES[k] * count);
    const needed = isBump(shape) ? 1 : SIZES.length;
    const row = this.walk.index.textures[relief];
    if (aligned && frames?.length === needed && row && (needed === 1 || row.relief !== undefined)) return true;
    this.#wrong.add(shape);
    this.walk.report(new PageError("PTM-V105", fill(objects.relief, { name: shape.name || objects.object })));
    return false;
  }

  /** Whether the shares of the view are still unknown. */
  get lacks() {
    return !this.#looked;
  }

  /** Levels of each normal map. */
  get levels() {
    const { index: { textures }, memory: { held } } = this.walk;
    return textures.flatMap(({ relief, normals }, t) => (normals || relief !== undefined ? [held[t]] : []));
  }

  /**
   * Adds the share of the view of each normal map to those of the item buffer: with a texture beside it that of
   * the texture at levels of as many texels to a metre, else that of its box at the level of its nearest point.
   * @param {import("../gl/renderer.js").Drawn[]} drawn
   * @param {ArrayLike<number>} eye
   * @param {number} lines of a screen that sees an angle whose half has the tangent 1
   */
  advance(drawn, eye, lines) {
    this.#clean();
    const { gl, walk: { client, client: { catalogue: { K, levels } }, needs: { present } } } = this;
    if (!present) return;
    const screen = gl.drawingBufferWidth * gl.drawingBufferHeight;
    let news = false;
    /** Of each normal map and each texture beside it. @type {Map<string, Float64Array>} */
    const beside = new Map();
    for (const { batches } of drawn) {
      for (const { look, low, high } of batches) {
        const { relief, blends, texture } = look;
        if (blends || !this.#isSound(look)) continue;
        if (isBump(look) && texture >= 0) {
          const finer = Math.log2(this.#densityOf(look) / this.#densityOf(look, texture));
          const pair = `${relief} ${texture}`, row = beside.get(pair) ?? new Float64Array(K);
          beside.set(pair, row);
          for (let k = 1; k <= levels[relief]; k++) {
            // Between two levels of the texture there are pixels that want the finer one.
            const column = Math.max(1, levels[texture] - levels[relief] + k + finer), low = Math.floor(column);
            const [one, other] = [low, low + 1].map((n) => (n < K ? present[texture * K + n] : 0));
            row[k] = Math.max(row[k], one + (column - low) * (other - one));
          }
          continue;
        }
        // Pixels of a metre.
        const metre = lines / 2 / Math.max(NEAREST, distance(eye, low, high));
        const [x, y, z] = low.map((from, k) => high[k] - from);
        const share = Math.min(1, metre * metre * y * Math.max(x, z) / screen);
        const spare = Math.max(0, Math.floor(Math.log2(this.#densityOf(look) / metre)));
        for (let k = 1, at = relief * K + 1; k <= Math.max(1, levels[relief] - spare); k++, at++) {
          if (present[at] >= share) continue;
          present[at] = share;
          news = true;
        }
      }
    }
    /** @type {Map<number, number>} */
    const sums = new Map();
    for (const [pair, row] of beside) {
      const first = parseInt(pair) * K;
      row.forEach((share, k) => sums.set(first + k, (sums.get(first + k) ?? 0) + share));
    }
    for (const [at, share] of sums) {
      if (present[at] >= share) continue;
      present[at] = share;
      news = true;
    }
    if (news) client.sees(present, client.hidden);
    this.#looked = true;
  }

  /** Frees what the cells no longer have. */
  #clean() {
    if (!this.#parts.size) return;
    const { cells } = this.walk.picture.renderer;
    const here = new Set([...cells.values()].flatMap(({ shapes }) => shapes));
    for (const shape of this.#parts.keys()) if (!here.has(shape)) this.#drop(shape);
  }

  /** @param {Shape} shape @param {number} [texture] its own in place of the normal map */
  #densityOf(shape, texture) {
    const densities = texture === undefined ? this.#density : this.#own;
    const known = densities.get(shape);
    if (known) return known;
    const { positions, indices, relief, frames, uvs } = shape;
    const places = /** @type {Float32Array} */ (texture === undefined ? frames?.[0] : uvs);
    const { width, height } = this.walk.index.textures[texture ?? relief];
    let area = 0, texels = 0;
    for (let k = 0; k < indices.length; k += 3) {
      const [a, b, c] = indices.subarray(k, k + 3);
      area += areaOf(positions, 3, a, b, c);
      texels += areaOf(places, 2, a, b, c);
    }
    const density = area * texels > 0 ? Math.sqrt(texels * width * height / area) : 1;
    densities.set(shape, density);
    return density;
  }

  /**
   * Draws batches into the bound framebuffer; true as long as a level of a texture fades in.
   * @param {import("../gl/camera.js").Camera} camera
   * @param {{buffers: CellBuffers, batch: Batch}[]} batches
   * @param {(at: Record<string, WebGLUniformLocation | null>, batch: Batch) => boolean} paint sets the uniforms
   *   of a batch's look
   * @param {number} now s
   */
  draw(camera, batches, paint, now) {
    const { gl, walk } = this;
    for (const program of [this.program, this.bumps, this.mirrors]) {
      aim(gl, program, camera);
      gl.uniform1i(program.at.relief, 2);
    }
    let fading = false;
    /** @type {Set<Shape>} */
    const done = new Set();
    for (const { buffers, batch } of batches) {
      if (done.has(batch.look)) continue;
      done.add(batch.look);
      const { relief, extras } = batch.look, bumps = isBump(batch.look);
      const { normalScale: scale = 1, normalWrapS, normalWrapT } = bumps ? JSON.parse(extras) : WHOLE;
      const clampU = normalWrapS === CLAMP, clampV = normalWrapT === CLAMP;
      const glossy = bumps && walk.picture.renderer.light?.mirrorOf(walk.picture.renderer, batch.look);
      const program = glossy ? this.mirrors : bumps ? this.bumps : this.program;
      gl.useProgram(program.program);
      gl.uniform1f(program.at.scale, scale);
      gl.activeTexture(gl.TEXTURE2);
      fading = walk.memory.of(relief)?.bind(clampU, clampV, now) || fading;
      gl.activeTexture(gl.TEXTURE0);
      fading = paint(program.at, batch) || fading;
      const alike = lookOf(batch.look);
      for (const shape of buffers.shapes) {
        if (lookOf(shape) !== alike) continue;
        const { array, count } = this.#part(shape);
        gl.bindVertexArray(array);
        gl.drawElements(gl.TRIANGLES, count, gl.UNSIGNED_INT, 0);
      }
    }
    return fading;
  }

  /** @param {Shape} shape */
  #part(shape) {
    const known = this.#parts.get(shape);
    if (known) return known;
    const { gl } = this, { positions, uvs, colors, indices, frames, spots, normals: curved, white } = shape;
    const array = gl.createVertexArray(), count = indices.length;
    gl.bindVertexArray(array);
    /** @type {WebGLBuffer[]} */
    const buffers = [];
    const [places, normals, tangents = null] = /** @type {Float32Array[]} */ (frames);
    const painted = colors && Float32Array.from(colors, (light) => codeOf(light / 65535, white));
    /** @type {[number, Float32Array | null, number][]} */
    const rows = [[0, positions, 3], [1, uvs, 2], [2, painted, 4], [3, spots, 2], [4, places, 2]];
    if (isBump(shape)) rows.push([5, curved && Float32Array.from(curved), 3]);
    else rows.push([5, normals, 3], [6, tangents, 4]);
    for (const [location, data, size] of rows) {
      if (!data) continue;
      buffers.push(this.#buffer(gl.ARRAY_BUFFER, data));
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, size, gl.FLOAT, false, 0, 0);
    }
    gl.vertexAttrib4f(2, 1, 1, 1, 1);
    buffers.push(this.#buffer(gl.ELEMENT_ARRAY_BUFFER, Uint32Array.from(indices)));
    gl.bindVertexArray(null);
    const part = { array, buffers, count };
    this.#parts.set(shape, part);
    return part;
  }

  /** @param {number} target @param {Float32Array | Uint32Array} data */
  #buffer(target, data) {
    const { gl } = this, buffer = gl.createBuffer();
    gl.bindBuffer(target, buffer);
    gl.bufferData(target, data, gl.STATIC_DRAW);
    return buffer;
  }

  /** @param {Shape} shape */
  #drop(shape) {
    const part = this.#parts.get(shape);
    if (!part) return;
    this.gl.deleteVertexArray(part.array);
    for (const buffer of part.buffers) this.gl.deleteBuffer(buffer);
    this.#parts.delete(shape);
  }
}

/** Whether the normal map of a shape is that of its material. @param {Shape} shape */
const isBump = ({ extras }) => extras.includes("normalCoords");

/**
 * Twice the area of a triangle.
 * @param {Float32Array} rows of coordinates
 * @param {number} size of each
 * @param {number} a
 * @param {number} b
 * @param {number} c
 */
function areaOf(rows, size, a, b, c) {
  const edge = (/** @type {number} */ end) =>
    [0, 1, 2].map((k) => (k < size ? rows[size * end + k] - rows[size * a + k] : 0));
  const [x, y, z] = edge(b), [u, v, w] = edge(c);
  return Math.hypot(y * w - z * v, z * u - x * w, x * v - y * u);
}
