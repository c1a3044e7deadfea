// The picture: the geometry in view, when it has changed, and when it was painted.

import { Fence } from "../gl/fence.js";
import { Renderer } from "../gl/renderer.js";
import { clock } from "../net/fetcher.js";
import { distance, meetsBox } from "../space/frustum.js";

/** Seconds between pictures while the visitor stands. */
const EVERY = 0.05;

export class Picture {
  /** What is drawn, the nearest cells first. @type {import("../gl/renderer.js").Drawn[]} */
  drawn = [];
  /** Visible cells in view without geometry. @type {{cell: number, box: number[]}[]} */
  missing = [];
  /** Times of the last change of the picture, of that of the view or its geometry, and of the last picture, s. */
  changed = 0;
  turned = 0;
  painted = -1;
  #scene = "";
  /** @type {number[]} */
  #frames = [];

  #gl;
  #index;

  /**
   * @param {WebGL2RenderingContext} gl
   * @param {import("../data/site.js").Index} index
   * @param {import("../gl/renderer.js").Textures} memory
   */
  constructor(gl, index, memory) {
    this.#gl = gl;
    this.#index = index;
    this.renderer = new Renderer(gl, memory, index.textures);
    this.fence = new Fence(gl);
  }

  /** Begins anew in a context that was lost. */
  restore() {
    const { renderer } = this, gl = this.#gl;
    renderer.statues?.delete();
    this.renderer = new Renderer(gl, renderer.memory, this.#index.textures);
    this.fence = new Fence(gl);
    this.turn();
  }

  /** The picture has changed. */
  touch() {
    this.changed = clock();
  }

  /** The view has changed, or its geometry, or what the item buffer is probed for. */
  turn() {
    this.touch();
    this.turned = this.changed;
  }

  /** Pictures in the second before the last one. */
  get fps() {
    return this.#frames.length;
  }

  /**
   * Uploads the geometry of visible cells, as long as the frame has time, and frees the others.
   * @param {number[]} visible
   * @param {Map<number, import("../data/glb.js").Shape[]>} shapes by cell
   * @param {number} room the visitor's cell
   * @param {() => boolean} late
   */
  bring(visible, shapes, room, late) {
    const { renderer } = this;
    renderer.keep(new Set(visible));
    for (const cell of visible) {
      const its = shapes.get(cell), before = renderer.cells.get(cell);
      if (!its || before?.shapes === its) continue;
      if (!renderer.add(cell, its, late)) break;
      // None of it may be in view, but now the item buffer has the room.
      if (before || cell === room) this.turn();
      if (late()) break;
    }
  }

  /**
   * Chooses what is drawn, and which cells are missing.
   * @param {import("../space/frustum.js").Frustum} frustum
   * @param {number[]} visible
   * @param {Map<number, unknown>} shapes by cell
   * @param {{low: Float64Array, high: Float64Array}} boxes of the cells
   */
  cull(frustum, visible, shapes, { low, high }) {
    this.drawn = [];
    for (const [cell, buffers] of this.renderer.cells) {
      const batches = buffers.batches.filter(({ low, high }) => meetsBox(frustum, low, high));
      if (batches.length) this.drawn.push({ cell, buffers, batches });
    }
    this.missing = visible
      .filter((cell) => !shapes.has(cell) && meetsBox(frustum, low, high, 3 * cell))
      .map((cell) => ({ cell, box: this.#index.cells[cell].box }));
    const far = (/** @type {{cell: number}} */ { cell }) => distance(frustum.eye, low, high, 3 * cell);
    this.drawn.sort((a, b) => far(a) - far(b));
    const scene = [this.drawn, this.missing].map((cells) => cells.map(({ cell }) => cell)).join(";");
    if (scene !== this.#scene) this.turn();
    this.#scene = scene;
  }

  /** Whether a resting visitor's picture has to wait. @param {number} now */
  waits(now) {
    const { fence } = this;
    return fence.busy || now - this.painted < fence.pause(EVERY);
  }

  /**
   * @param {import("../gl/camera.js").Camera} camera
   * @param {number} now
   * @param {import("../compare.js").Comparison | null} comparison of which the right half is drawn
   */
  paint(camera, now, comparison) {
    const gl = this.#gl, { width, height } = gl.canvas;
    this.painted = now;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, width, height);
    if (this.renderer.draw(camera, this.drawn, now)) this.touch();
    if (comparison) {
      const half = width >> 1;
      gl.enable(gl.SCISSOR_TEST);
      gl.scissor(half, 0, width - half, height);
      comparison.renderer.draw(camera, this.drawn, now);
      gl.disable(gl.SCISSOR_TEST);
    }
    this.fence.mark(now);
    this.#frames = [...this.#frames.filter((at) => at > now - 1), now];
  }
}
