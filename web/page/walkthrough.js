// The walk. Each frame locates the visitor, draws the cells, and chooses the contents of texture
// memory and the next requests (docs/formats/client.md).

import { Locator } from "../client/src/locating.js";
import { beginningOf } from "./beginning.js";
import { fitting, levelsOf } from "./data/site.js";
import { Reserve } from "./gl/reserve.js";
import { TextureMemory } from "./gl/texture-memory.js";
import { Viewport } from "./gl/viewport.js";
import { loadComparison, loadLight, loadReliefs, loadStatues } from "./load-later.js";
import { clock, Fetcher } from "./net/fetcher.js";
import { watchLink } from "./net/timings.js";
import { catalogueOf } from "./policy/catalogue.js";
import { Client } from "./policy/client.js";
import { LOOK_SECONDS } from "./policy/constants.js";
import { Estimate } from "./policy/estimate.js";
import { POLICIES } from "./policy/policies.js";
import { Stream } from "./stream.js";
import { Picture } from "./walk/picture.js";
import { Stillness } from "./walk/stillness.js";
import { losses, previewed, settled, shares } from "./walk/textures.js";
import { ViewNeeds } from "./walk/view-needs.js";
import { page } from "./words/english.js";

/** Seconds of rest until the canvas is as fine as the screen again. */
const RESTING = 0.4;
/**
 * Seconds of a frame for uploads, and as much for geometry that comes into view: on a slow machine a share
 * of the last frame, which takes as long again, up to a limit.
 */
const UPLOAD_TIME = 0.004, UPLOAD_SHARE = 0.25, UPLOAD_MOST = 0.03;

/** @typedef {import("./gl/camera.js").Pose} Pose */

export class Walkthrough {
  cell = -1;
  /** All errors, in order. @type {{code: string, message: string}[]} */
  faults = [];
  /** @type {ArrayLike<number>} */
  #eye = [0, 0, 0];
  /** Whether the first picture of the room has been drawn, and whether it can be. */
  begun = false;
  #ready = false;
  /** The means for a comparison with full resolution. @type {import("./compare.js").Comparison | null} */
  comparison = null;
  /** @type {import("./recorder.js").Recorder | null} */
  recorder = null;
  /** Times of the last look and of the frame before, s. */
  #looked = -1;
  #before = 0;
  /** Scripts on their way: that of light is the first of two. */
  #loading = 0;
  #reserve;
  #covered;
  #stillness = new Stillness();
  /** Levels of a texture that make a first picture. */
  firstLevels = 5;

  /**
   * @param {HTMLCanvasElement} canvas
   * @param {WebGL2RenderingContext} gl
   * @param {import("./data/site.js").Site} site
   * @param {object} options
   * @param {import("./stream.js").Decoders} options.decoders
   * @param {import("./net/opening.js").Opening | null} options.opening
   * @param {string} options.policy
   * @param {number} options.budget bytes of texture memory
   * @param {boolean} options.low whether nothing reflects
   * @param {boolean} options.covered whether a poster covers the picture until the walk begins
   * @param {import("./app.js").App["emit"]} emit
   */
  constructor(canvas, gl, site, { decoders, opening, policy, budget, low, covered }, emit) {
    const index = fitting(site.index, gl.getParameter(gl.MAX_TEXTURE_SIZE), low), { textures } = index;
    const catalogue = catalogueOf(index), estimate = new Estimate();
    const fetcher = new Fetcher((message) => emit("notice", { message }));
    watchLink(estimate, fetcher);
    this.index = index;
    this.gl = gl;
    this.emit = emit;
    this.budget = budget;
    this.policy = policy;
    this.#covered = covered;
    this.#reserve = new Reserve(catalogue);
    this.viewport = new Viewport(canvas, index);
    const client = (this.client = new Client(catalogue, { budget, policy: POLICIES[policy] }));
    const stream = (this.stream = new Stream({
      site,
      index,
      client,
      locator: new Locator(index.cells.map(({ box }) => box)),
      estimate,
      fetcher,
      decoders,
      opening,
      report: this.report,
    }));
    this.rows = textures.map(levelsOf);
    this.memory = this.#memoryOf();
    const picture = (this.picture = new Picture(gl, index, this.memory));
    const needs = (this.needs = new ViewNeeds(gl, client, textures));
    stream.follow(this.viewport).then((present) => present && needs.expect(present), () => {});
    this.#equip();
    canvas.addEventListener("webglcontextlost", (event) => {
      event.preventDefault();
      this.memory.lose();
      this.comparison?.memory.lose();
    });
    canvas.addEventListener("webglcontextrestored", () => {
      picture.restore();
      needs.restore();
      this.#equip();
      this.memory.resume();
      this.#compare();
    });
  }

  /**
   * Reports an error: without the first room, or a decoder, the walk cannot begin; otherwise it goes on.
   * @param {import("./net/errors.js").PageError} error
   * @param {string} [kind] of the missing file
   * @param {number} [number]
   */
  report = (error, kind, number) => {
    this.faults.push({ code: error.code, message: error.message });
    const room = (kind === "record" || kind === "geometry") && number === this.cell;
    const { previews, workers } = this.stream;
    const decoder = kind === "decoder" && (previews.length === 0 || workers.ended);
    const fatal = !this.begun && (room || decoder);
    this.emit(fatal ? "error" : "notice", error);
  };

  /** Loads what draws light, and after it objects with relief, if the site has any. */
  async #equip() {
    const { light, octrees, textures } = this.index;
    const relieved = textures.some((row) => "relief" in row || row.normals);
    const relief = relieved ? loadReliefs() : octrees && loadStatues(), scripts = [light && loadLight(), relief];
    this.#loading = scripts.length;
    relief?.catch(() => {}); // below
    for (const script of scripts) {
      await script?.then(({ show }) => show(this)).catch(() => this.emit("notice", { message: page.unloaded }));
      this.#loading--;
    }
  }

  /** Cells visible from those that the visitor is in, his own first. */
  get visible() {
    const { known, cell } = this.client, here = known[this.cell] ? this.cell : cell;
    if (!known[here]) return this.cell < 0 ? [] : [this.cell];
    const cells = this.stream.locator.around(this.#eye, here);
    // The record of the present cell may be on its way.
    if (this.cell >= 0) cells.push(this.cell);
    return [...new Set(cells.flatMap((c) => known[c]?.visible ?? [c]))];
  }

  /** @param {Pose} pose */
  locate({ eye }) {
    this.#eye = eye;
    const { locator } = this.stream, cell = locator.locate(eye, this.cell);
    if (cell >= 0) return this.enter(cell);
    // Among cells without a record, one whose box holds the eye.
    const maybe = locator.candidates(eye, this.cell);
    if (maybe.length && !maybe.includes(this.cell)) this.enter(maybe[0]);
  }

  /** @param {number} cell that the visitor is in */
  enter(cell) {
    if (cell === this.cell) return;
    this.cell = cell;
    this.#looked = -1;
    this.emit("cell", cell);
  }

  /**
   * A frame.
   * @param {Pose} pose
   */
  frame(pose) {
    const now = clock();
    if (this.gl.isContextLost()) return;
    const { client, comparison, needs, picture, picture: { fence, renderer }, stream, viewport } = this;
    const stillness = this.#stillness;
    fence.reached(now);
    // Before anything is uploaded: reading waits for what was begun before it.
    needs.read(now);
    this.locate(pose);
    const turns = stillness.takes(pose, now);
    // A canvas of another size is empty.
    const resized = viewport.settle(now - this.#before, now - stillness.moved < RESTING);
    if (turns || resized) picture.turn();
    const time = Math.max(UPLOAD_TIME, Math.min(UPLOAD_SHARE * (now - this.#before), UPLOAD_MOST));
    this.#before = now;
    let until = now + time;
    const late = () => clock() > until;
    const frustum = viewport.frustum(pose), { visible } = this;
    picture.bring(visible, stream.shapes, this.cell, late);
    picture.cull(frustum, visible, stream.shapes, client.catalogue);
    until = clock() + time;
    if (this.memory.pump(now, late) || comparison?.memory.pump(now, late)) picture.touch();
    renderer.light?.adapt(this, pose.eye, now);
    if (this.begun) {
      const lines = viewport.across(Math.PI / 2);
      renderer.statues?.advance(picture.drawn, pose.eye, lines, !stream.frozen && !document.hidden);
    }
    if (stream.news || now - this.#looked >= LOOK_SECONDS) this.#look(now, frustum, stillness.lasts(now));
    const camera = viewport.camera(pose);
    if (!this.begun) {
      const { progress, over } = beginningOf(this);
      this.emit("progress", progress);
      this.begun = this.#ready && !fence.busy;
      this.#ready ||= over && this.#loading < 2;
      if (this.begun) this.emit("first-picture", undefined);
    }
    const stands = !turns && stillness.moved < picture.painted;
    const waits = stands && !resized && (needs.items.busy || picture.waits(now));
    if (this.#loading < 2 && (this.#ready || !this.#covered) && picture.changed > picture.painted && !waits) {
      picture.paint(camera, now, comparison);
    }
    const room = this.cell < 0 || renderer.cells.has(this.cell);
    needs.draw(picture, viewport, camera, { now, stands, room });
    this.recorder?.frame(now, frustum, needs.drawn);
    stream.pump();
  }

  /** @param {boolean} on whether texture memory stays unchanged and no requests are made */
  freeze(on) {
    this.stream.frozen = on;
    if (on) this.memory.hold();
  }

  /** @param {boolean} on whether the right half shows full resolution */
  compare(on) {
    this.stream.comparing = on;
    if (this.gl.isContextLost()) return;
    this.comparison?.delete();
    this.#compare();
  }

  /** Makes the means for a comparison, if there is one. */
  async #compare() {
    const { gl, picture, stream } = this;
    this.comparison = null;
    picture.touch();
    if (!stream.comparing) return;
    const script = await loadComparison().catch(() => null);
    if (!script) {
      stream.comparing = false;
      return this.emit("notice", { message: page.unloaded });
    }
    if (!stream.comparing || this.comparison || gl.isContextLost()) return;
    this.comparison = new script.Comparison(this);
    picture.touch();
  }

  /** @param {string} policy one of `POLICIES` */
  choose(policy) {
    const { client, picture } = this;
    this.policy = policy;
    client.policy = POLICIES[policy];
    this.memory = picture.renderer.memory = this.#memoryOf(this.memory);
    picture.touch();
  }

  /**
   * Texture memory of the kind that the policy draws from: the present one, or another in its place.
   * @param {import("./gl/renderer.js").Textures} [before]
   * @returns {import("./gl/renderer.js").Textures}
   */
  #memoryOf(before) {
    const { Memory = TextureMemory } = POLICIES[this.policy];
    if (before instanceof Memory) return before;
    before?.delete();
    const memory = new Memory(this.gl, this.rows, (t, levels) => this.stream.decode(t, levels));
    return Object.assign(memory, { fades: before?.fades ?? true });
  }

  /**
   * @param {number} now
   * @param {import("./space/frustum.js").Frustum} frustum
   * @param {boolean} still
   */
  #look(now, frustum, still) {
    this.#looked = now;
    const { budget, cell, client, memory, stream } = this, reserve = this.#reserve;
    stream.news = false;
    client.downloads.now = now;
    this.comparison?.settle();
    if (stream.frozen) return;
    reserve.enter(cell, budget);
    client.budget = budget - reserve.bytes;
    client.look({ now, cell, frustum, still });
    while (reserve.grow(client.column) && client.fit(budget - reserve.bytes));
    memory.budget = budget;
    memory.settle(client.column, shares(this), losses(client));
  }

  /** Whether everything that this view could use within the budget is present, in the best form. */
  get complete() {
    return this.has(true);
  }

  /** Whether that is so, of objects with any mesh and without relief unless `finer`. @param {boolean} finer */
  has(finer) {
    const { client, needs, picture, picture: { renderer }, stream: { shapes } } = this;
    if (!needs.present || needs.drawn < picture.turned || this.#looked < picture.changed) return false;
    if (this.#ready && picture.painted < picture.changed) return false;
    if (this.visible.some((c) => renderer.cells.get(c)?.shapes !== shapes.get(c))) return false;
    // The walk begins without relief.
    if (finer && (this.#loading || renderer.statues?.lacks)) return false;
    if (client.cell !== this.cell || client.missing(false, false, finer) > 0) return false;
    return this.viewport.full && settled(this);
  }

  /** Whether it is complete, with exact texels alone, and no file of it has failed. */
  get exact() {
    return this.complete && this.client.missing(false, true) === 0 && !previewed(this);
  }
}
