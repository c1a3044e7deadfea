// Draws the cells: opaque surfaces cell by cell, then transparent ones, the farthest first.

import { CellBuffers, pack } from "./cell-buffers.js";
import { aim, programOf } from "./program.js";
import { SURFACES } from "./shaders.js";
import { levelSizes } from "../../client/src/levels.js";

/** @typedef {import("./cell-buffers.js").Batch} Batch */
/** @typedef {import("../data/glb.js").Shape} Shape */

/**
 * The visible batches of a cell.
 * @typedef {object} Drawn
 * @property {number} cell
 * @property {CellBuffers} buffers
 * @property {Batch[]} batches
 */

/** @typedef {Pick<TextureMemory, keyof TextureMemory>} Textures a texture memory of any kind */
/** @typedef {import("./texture-memory.js").TextureMemory} TextureMemory */

export class Renderer {
  /** @type {Map<number, CellBuffers>} */
  cells = new Map();
  /** Packing of cells under way. @type {Map<number, {shapes: Shape[], steps: ReturnType<typeof pack>}>} */
  #packing = new Map();
  /** The program in use. @type {import("./program.js").Program | null} */
  #used = null;

  /**
   * @param {WebGL2RenderingContext} gl
   * @param {Textures} memory
   * @param {import("../data/site.js").TextureRow[]} rows of the textures
   */
  constructor(gl, memory, rows) {
    this.gl = gl;
    this.memory = memory;
    this.means = rows.map(({ color }) => color.map((part) => part / 255));
    this.widths = rows.map((row) => levelSizes(row).at(-1)?.width ?? 1);
    this.samples = gl.getParameter(gl.SAMPLES) || 1;
    /** Light of the site, once its script is here. @type {import("../light.js").Light | null} */
    this.light = null;
    this.surface = this.compile("surface");
    /** Draws what has relief, if the site has any.
     * @type {Pick<import("../../systems/octree/statues.js").Statues, "delete" | "has" | "lacks" | "levels" | "advance">
     *   & Pick<import("../relief/reliefs.js").Reliefs, "draw"> & {bytes?: number} | null} */
    this.statues = null;
  }

  /**
   * Adds a cell, or as much of it as time permits; true once it is complete. It then takes the place of the
   * same cell with other shapes. Of a cell that is being added, other shapes have to wait.
   * @param {number} cell
   * @param {Shape[]} shapes
   * @param {() => boolean} late whether the time has come
   */
  add(cell, shapes, late) {
    const packing = this.#packing.get(cell) ?? { shapes, steps: pack(shapes) };
    this.#packing.set(cell, packing);
    const { steps } = packing;
    let step = steps.next();
    while (!step.done) {
      if (late()) return false;
      step = steps.next();
    }
    this.#packing.delete(cell);
    this.cells.get(cell)?.delete();
    this.cells.set(cell, new CellBuffers(this.gl, step.value, packing.shapes));
    return true;
  }

  /** Removes all cells except the wanted ones. @param {Set<number>} wanted */
  keep(wanted) {
    for (const [cell, buffers] of this.cells) {
      if (wanted.has(cell)) continue;
      buffers.delete();
      this.cells.delete(cell);
    }
    for (const cell of this.#packing.keys()) if (!wanted.has(cell)) this.#packing.delete(cell);
  }

  /**
   * A program for surfaces, in the light of the site.
   * @param {string} name
   * @param {string[]} [sources] of the shaders
   * @param {boolean} [reflects] whether for those that reflect
   */
  compile(name, sources = SURFACES, reflects) {
    return programOf(this.gl, name, this.light?.sources(sources, reflects) ?? sources);
  }

  delete() {
    this.keep(new Set());
    this.gl.deleteProgram(this.surface.program);
  }

  /** Bytes of vertices and indices. */
  get bytes() {
    let sum = 0;
    for (const { bytes } of this.cells.values()) sum += bytes;
    return sum;
  }

  /**
   * Draws into the bound framebuffer; true as long as a level fades in.
   * @param {import("./camera.js").Camera} camera
   * @param {Drawn[]} drawn nearest cells first
   * @param {number} now s
   */
  draw(camera, drawn, now) {
    const { gl } = this;
    gl.clearColor(0.16, 0.17, 0.19, 1);
    gl.depthMask(true);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.disable(gl.BLEND);
    this.#used = null;
    let fading = false;
    /** @type {{buffers: CellBuffers, batch: Batch, far: number}[]} */
    const behind = [], statues = [];
    for (const { buffers, batches } of drawn) {
      gl.bindVertexArray(buffers.vertexArray);
      for (const batch of batches) {
        if (batch.look.blends) {
          behind.push({ buffers, batch, far: distance(camera.eye, batch) });
        } else if (this.statues?.has(batch.look)) {
          statues.push({ buffers, batch });
        } else {
          fading = this.#draw(camera, buffers, batch, now) || fading;
        }
      }
    }
    if (statues.length) {
      const paint = (/** @type {any} */ at, /** @type {Batch} */ batch) => this.#paint(at, batch, now);
      fading = this.statues?.draw(camera, statues, paint, now) || fading;
    }
    this.light?.surround(this, camera);
    this.#used = null;
    if (behind.length) {
      gl.enable(gl.BLEND);
      gl.depthMask(false);
      for (const { buffers, batch } of behind.sort((a, b) => b.far - a.far)) {
        gl.bindVertexArray(buffers.vertexArray);
        fading = this.#draw(camera, buffers, batch, now) || fading;
      }
    }
    gl.bindVertexArray(null);
    return fading;
  }

  /**
   * @param {import("./camera.js").Camera} camera
   * @param {CellBuffers} buffers
   * @param {Batch} batch
   * @param {number} now
   */
  #draw(camera, buffers, batch, now) {
    const { gl } = this, { look } = batch, mirror = this.light?.mirrorOf(this, look), use = mirror ?? this.surface;
    if (use !== this.#used) aim(gl, (this.#used = use), camera);
    // Glass comes with its reflection, which does not fade with its colour.
    const source = mirror && !look.white ? gl.ONE : gl.SRC_ALPHA;
    gl.blendFunc(source, gl.ONE_MINUS_SRC_ALPHA);
    const fading = this.#paint(use.at, batch, now);
    buffers.draw(batch);
    return fading;
  }

  /**
   * Sets the uniforms of the look of a batch.
   * @param {import("./program.js").Program["at"]} at
   * @param {Batch} batch
   * @param {number} now
   */
  #paint(at, batch, now) {
    const { gl } = this;
    const { texture, clampU, clampV, cutoff, twoSided } = batch.look;
    gl[twoSided ? "disable" : "enable"](gl.CULL_FACE);
    gl[cutoff ? "enable" : "disable"](gl.SAMPLE_ALPHA_TO_COVERAGE);
    gl.uniform4fv(at.color, batch.color);
    gl.uniform1i(at.textured, +(texture >= 0));
    const storage = texture < 0 ? null : this.memory.of(texture);
    gl.uniform1i(at.channels, storage?.channels ?? 0);
    if (texture >= 0) gl.uniform3fv(at.mean, this.means[texture]);
    const fading = this.light?.paint(this, at, batch.look, now);
    const fades = storage?.bind(clampU, clampV, now);
    gl.uniform3f(at.cut, cutoff, storage ? this.widths[texture] * 2 ** storage.left : 1, this.samples);
    return /** @type {boolean} */ (fades || fading);
  }
}

/**
 * The distance of the middle of a batch's box.
 * @param {number[]} eye
 * @param {Batch} batch
 */
function distance(eye, { low, high }) {
  return Math.hypot(...eye.map((x, k) => (low[k] + high[k]) / 2 - x));
}
