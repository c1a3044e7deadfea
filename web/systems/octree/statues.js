// Objects with octree textures, in the rooms of a walk: a script of its own, which sites with such objects
// load. They are lit by a lamp, as `ptm simulate --lit` lights them; without levels they look as others.

import { clock } from "../../page/net/fetcher.js";
import { PageError } from "../../page/net/errors.js";
import { aim } from "../../page/gl/program.js";
import { corners, CUT, TEXEL } from "../../page/gl/shaders.js";
import { distance } from "../../page/space/frustum.js";
import { LIT } from "../../page/relief/lamp.js";
import { LOOK_UP } from "./look-up.js";
import { checkOctree, Octree, followingOf } from "./octree.js";
import { objects } from "../../page/words/english.js";
import { fill } from "../../page/words/language.js";

/** Bytes of octrees on the graphics card, at most. */
const MOST = 128 << 20;
/** Nearest distance of the eye that counts, m. */
const NEAREST = 0.1;

const VERTEX = corners(`
uniform vec3 low;
uniform float side;
out vec3 q;`, "q = (position - low) / side;");

const FRAGMENT = `#version 300 es
precision highp float;
precision highp int;
precision highp usampler2D;
in vec3 seen;
in vec2 uv;
in vec3 painted;
in vec3 q;
out vec4 shown;
${TEXEL}
${LOOK_UP}
${LIT}
void main() {
  int stop = stopDepth(q);
  vec4 sampled = textured ? texel() : vec4(1.0);
  vec3 normal = normalize(vec3(texel(octree, addressAt(q, stop)).rgb) / 127.5 - 1.0);
  shown = vec4(sampled.rgb * color.rgb * painted * lit(normal), sampled.a * color.a);${CUT}
}`;

/** @typedef {import("../../page/gl/renderer.js").Drawn} Drawn */
/** @typedef {{file: string, cube: {low: number[], side: number}, levels: number[], ends: number[],
 *   crc32: number[], differences?: number[]}} OctreeRow */

export class Statues {
  /** Those that are, or were, in view. @type {(Octree | undefined)[]} */
  #octrees = [];
  /** Of those in view, the pixels of a node of depth 0. @type {Map<number, number>} */
  #pixels = new Map();
  /** Of those in view, the share of the screen that their boxes take. @type {Map<number, number>} */
  #shares = new Map();
  /** Whether levels wait for `load`. */
  competes = () => false;
  #looked = false;
  /** When each was last in view, s. @type {number[]} */
  #seen = [];

  /**
   * @param {WebGL2RenderingContext} gl
   * @param {OctreeRow[]} rows of the index; objects of wrong ones look like others
   * @param {import("../../page/data/site.js").Site} site
   * @param {import("../../page/net/fetcher.js").Fetcher} fetcher
   * @param {(fault: PageError) => void} report
   * @param {() => void} touch called when the picture changes
   * @param {import("../../page/gl/renderer.js").Renderer} renderer that they are drawn for
   */
  constructor(gl, rows, site, fetcher, report, touch, renderer) {
    this.gl = gl;
    this.site = site;
    this.fetcher = fetcher;
    this.report = report;
    this.touch = touch;
    this.indices = rows.map((row) => {
      try {
        const { cube, levels, file, ends, crc32 } = row, index = { cube, levels, streams: [{ file, ends, crc32 }] };
        checkOctree(index);
        return index;
      } catch (fault) {
        report(new PageError("PTM-V105", fill(objects.octree, { reason: /** @type {Error} */ (fault).message })));
        return null;
      }
    });
    this.program = renderer.compile("octree", [VERTEX, FRAGMENT]);
  }

  delete() {
    for (const octree of this.#octrees) octree?.delete();
    this.#octrees = [];
  }

  /** Whether the octree of a look has levels to show. @param {import("../../page/data/glb.js").Shape} look */
  has({ octree }) {
    return (this.#octrees[octree]?.levels ?? 0) > 0;
  }

  /** Whether an octree in view has too few levels for the screen, as far as is known. */
  get lacks() {
    return !this.#looked || [...this.#pixels.keys()].some((number) => this.#wants(number));
  }

  /** Levels of each octree that was in view. */
  get levels() {
    return Array.from(this.#octrees, (octree) => octree?.levels ?? 0);
  }

  /** Bytes on the graphics card. */
  get bytes() {
    return this.#octrees.reduce((sum, octree) => sum + (octree?.bytes ?? 0), 0);
  }

  /**
   * Fetches the next level of an octree in view, that with the largest nodes.
   * @param {Drawn[]} drawn
   * @param {ArrayLike<number>} eye
   * @param {number} lines of a screen that sees an angle whose half has the tangent 1
   * @param {boolean} loads whether anything may be fetched
   */
  advance(drawn, eye, lines, loads) {
    this.#pixels.clear();
    this.#shares.clear();
    this.#looked = true;
    const now = clock(), screen = this.gl.drawingBufferWidth * this.gl.drawingBufferHeight;
    for (const { batches } of drawn) {
      for (const { look: { octree, blends }, low, high } of batches) {
        const index = this.indices[octree];
        if (!index || blends) continue;
        const away = Math.max(NEAREST, distance(eye, low, high));
        const scale = lines / 2 / away, pixels = scale * index.cube.side;
        this.#pixels.set(octree, Math.max(pixels, this.#pixels.get(octree) ?? 0));
        const [width, height, depth] = [0, 1, 2].map((k) => high[k] - low[k]);
        const share = Math.min(1, scale * scale * height * Math.max(width, depth) / screen);
        this.#shares.set(octree, Math.max(share, this.#shares.get(octree) ?? 0));
        this.#seen[octree] = now;
      }
    }
    if (!loads || this.competes() || this.#octrees.some((octree) => octree?.running)) return;
    let next = -1, most = 0;
    for (const number of this.#pixels.keys()) {
      const size = this.#nodes(number);
      if (size > most && this.#wants(number)) [next, most] = [number, size];
    }
    if (next >= 0) this.load(next);
  }

  /**
   * The octrees in view that may be requested now: their numbers, levels that are there, that the next request
   * brings at least, and that the screen wants, and their shares of the screen.
   */
  get wanted() {
    const free = [...this.#pixels].filter(([number]) => this.#wants(number) && !this.#octrees[number]?.running);
    return free.map(([number, pixels]) => {
      const levels = this.#octrees[number]?.levels ?? 0, count = this.indices[number]?.levels.length ?? 0;
      return {
        number, levels, following: followingOf(levels, count), share: this.#shares.get(number) ?? 0,
        finest: Math.min(count, 1 + Math.ceil(Math.log2(pixels))),
      };
    });
  }

  /** Pixels of the finest nodes of an octree in view. @param {number} number */
  #nodes(number) {
    const levels = this.#octrees[number]?.levels ?? 0;
    return (this.#pixels.get(number) ?? 0) * 2 ** -Math.max(0, levels - 1);
  }

  /** @param {number} number */
  #wants(number) {
    const octree = this.#octrees[number];
    if (!octree) return this.#nodes(number) > 1 && this.#fits(number);
    return !octree.complete && !octree.rests && this.#nodes(number) > 1;
  }

  /** Bytes that an octree takes on the graphics card. @param {number} number */
  #size(number) {
    return 4 * (this.indices[number]?.levels.reduce((sum, count) => sum + count, 0) ?? 0);
  }

  /** Whether there is room for an octree beside the others in view. @param {number} number */
  #fits(number) {
    const others = [...this.#pixels.keys()].filter((other) => other !== number && this.#octrees[other]);
    return others.reduce((sum, other) => sum + this.#size(other), this.#size(number)) <= MOST;
  }

  /**
   * Fetches the next levels of an octree.
   * @param {number} number
   * @param {number} [end] the number of its levels then
   * @param {{left: number}} [progress] bytes still to come, updated
   */
  load(number, end, progress) {
    let octree = this.#octrees[number];
    const index = this.indices[number];
    if (!index) return;
    if (!octree) {
      this.#free(this.#size(number));
      octree = new Octree(this.gl, index, (name) => this.site.of(name), this.fetcher, 0);
      this.#octrees[number] = octree;
    }
    octree.progress = progress;
    return octree.advance(() => true, this.report, this.touch, end);
  }

  /** Removes octrees out of view, those first that were seen first, until there is room. @param {number} bytes */
  #free(bytes) {
    const hidden = [...this.#octrees.keys()].filter((n) => this.#octrees[n] && !this.#pixels.has(n));
    for (const number of hidden.sort((a, b) => this.#seen[a] - this.#seen[b])) {
      if (this.bytes + bytes <= MOST) return;
      this.#octrees[number]?.delete();
      delete this.#octrees[number];
    }
  }

  /**
   * Draws batches into the bound framebuffer; true as long as a level of a texture fades in.
   * @param {import("../../page/gl/camera.js").Camera} camera
   * @param {{buffers: import("../../page/gl/cell-buffers.js").CellBuffers,
   *   batch: import("../../page/gl/cell-buffers.js").Batch}[]} batches
   * @param {(at: Record<string, WebGLUniformLocation | null>, batch: import("../../page/gl/cell-buffers.js").Batch)
   *   => boolean} paint sets the uniforms of a batch's look
   */
  draw(camera, batches, paint) {
    const { gl, program } = this, { at } = program;
    aim(gl, program, camera);
    gl.uniform1i(at.octree, 3);
    let fading = false;
    for (const { buffers, batch } of batches) {
      const octree = /** @type {Octree} */ (this.#octrees[batch.look.octree]);
      const { cube: { low, side } } = octree.index;
      gl.activeTexture(gl.TEXTURE3);
      gl.bindTexture(gl.TEXTURE_2D, octree.texels[0].texture);
      gl.activeTexture(gl.TEXTURE0);
      gl.uniform3fv(at.low, low);
      gl.uniform1f(at.side, side);
      gl.uniform1i(at.texels, octree.count);
      gl.uniform1i(at.deepest, octree.levels - 1);
      gl.uniform1i(at.partial, 0);
      gl.bindVertexArray(buffers.vertexArray);
      fading = paint(at, batch) || fading;
      buffers.draw(batch);
    }
    return fading;
  }
}
