// The walk. Each frame locates the visitor, draws the cells, and chooses the contents of texture
// memory and the next requests (docs/formats/client.md).

import { Locator } from "../client/src/locating.js";
import { beginningOf } from "./beginning.js";
import { fitting, levelsOf } from "./data/site.js";
import { cameraOf } from "./gl/camera.js";
import { Fence } from "./gl/fence.js";
import { ItemBuffer } from "./gl/item-buffer.js";
import { Renderer } from "./gl/renderer.js";
import { Reserve } from "./gl/reserve.js";
import { Sharpness } from "./gl/sharpness.js";
import { TextureMemory } from "./gl/texture-memory.js";
import { loadComparison, loadReliefs, loadStatues } from "./load-later.js";
import { clock, Fetcher } from "./net/fetcher.js";
import { watchLink } from "./net/timings.js";
import { catalogueOf } from "./policy/catalogue.js";
import { Client } from "./policy/client.js";
import { Estimate } from "./policy/estimate.js";
import { POLICIES } from "./policy/policies.js";
import { sightOf } from "./policy/sight.js";
import { frustumOf } from "./space/frustum.js";
import { Stream } from "./stream.js";
import { inView } from "./walk/in-view.js";
import { Stillness } from "./walk/stillness.js";
import { losses, previewed, settled, shares } from "./walk/textures.js";
import { page } from "./words/english.js";

/** Seconds between item buffers, and between looks of the client. */
const ITEM_EVERY = 0.1, LOOK_EVERY = 0.2;
/** Seconds between pictures while the visitor stands, and of rest until then. */
const PAINT_EVERY = 0.05, RESTING = 0.4;
/** Times as long as the last one took, on a machine that draws slowly: it also has to decode. */
const PAUSE = 2;
/**
 * Seconds of a frame for uploads, and as much for geometry that comes into view: on a slow machine a share
 * of the last frame, which takes as long again, up to a limit.
 */
const UPLOAD_TIME = 0.004, UPLOAD_SHARE = 0.25, UPLOAD_MOST = 0.03;
/** Largest vertical field of view on a narrow screen, radians. */
const TALLEST = 1.4;
/** @typedef {import("./gl/camera.js").Pose} Pose */
/** @typedef {import("./gl/renderer.js").Drawn} Drawn */

/** Seconds between pictures of a resting visitor. @param {number} least @param {Fence} [fence] */
const pause = (least, fence) => Math.max(least, PAUSE * (fence?.took ?? 0));

export class Walkthrough {
  /** @type {Drawn[]} */
  drawn = [];
  cell = -1;
  /** All errors, in order. @type {{code: string, message: string}[]} */
  faults = [];
  /** @type {ArrayLike<number>} */
  #eye = [0, 0, 0];
  /** Whether the first picture of the room has been drawn, and whether it can be. */
  begun = false;
  #ready = false;
  /** Whether texture memory stays unchanged and nothing is requested. */
  frozen = false;
  /** Whether only visible textures and cells are fetched. */
  saving = false;
  /** Whether to compare with full resolution, and the means for it. */
  comparing = false;
  /** @type {import("./compare.js").Comparison | null} */
  comparison = null;
  /** @type {import("./recorder.js").Recorder | null} */
  recorder = null;
  /** Tests markers against the depth of the item buffer. @type {((camera: import("./gl/camera.js").Camera) => void) | null} */
  probe = null;
  /** Times of the last change of the picture, of that of the view or its geometry, and of the last picture, s. */
  #changed = 0;
  #turned = 0;
  #painted = -1;
  #looked = -1;
  #before = 0;
  /** Whether the script of relief is on its way. */
  #loading = false;
  /** Visible cells in view without geometry. @type {{cell: number, box: number[]}[]} */
  #missing = [];
  #scene = "";
  #itemDrawn = -1;
  /** @type {import("./policy/sight.js").Sight | null} */
  #sight = null;
  #sightDrawn = -1;
  /** Whether the last item buffer has the room, and whether one that has it was read. */
  #drew = false;
  #shown = false;
  /** The columns that the opening's view wants, until then. @type {Float64Array | null} */
  #expected = null;
  /** @type {number[]} */
  #frames = [];
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
   * @param {boolean} options.covered whether a poster covers the picture until the walk begins
   * @param {import("./app.js").App["emit"]} emit
   */
  constructor(canvas, gl, site, options, emit) {
    const index = fitting(site.index, gl.getParameter(gl.MAX_TEXTURE_SIZE));
    this.index = index;
    this.canvas = canvas;
    this.gl = gl;
    this.site = site;
    this.emit = emit;
    this.budget = options.budget;
    this.policy = options.policy;
    this.covered = options.covered;
    this.catalogue = catalogueOf(index);
    this.reserve = new Reserve(this.catalogue);
    this.sharpness = new Sharpness(canvas);
    this.stillness = new Stillness();
    this.estimate = new Estimate();
    this.fetcher = new Fetcher((message) => emit("notice", { message }));
    watchLink(this.estimate, this.fetcher);
    this.locator = new Locator(index.cells.map(({ box }) => box));
    this.client = new Client(this.catalogue, {
      budget: options.budget,
      policy: POLICIES[options.policy],
    });
    this.stream = new Stream({
      site,
      index,
      client: this.client,
      locator: this.locator,
      estimate: this.estimate,
      fetcher: this.fetcher,
      decoders: options.decoders,
      opening: options.opening,
      // Of the field of view of openings.
      lines: () => this.sharpness.lines * Math.tan(this.angle / 2) / Math.tan(this.tall / 2),
      rests: () => this.#rests,
      expect: (present) => {
        if (this.#shown) return;
        this.#expected = present;
        this.#see(this.#sight ?? { present, hidden: new Float64Array(this.catalogue.C) });
      },
      report: (error, kind, number) => this.#report(error, kind, number),
    });
    this.rows = index.textures.map(levelsOf);
    this.memory = this.#memoryOf();
    const low = [0, 1, 2].map((k) => Math.min(...index.cells.map(({ box }) => box[k])));
    const high = [0, 1, 2].map((k) => Math.max(...index.cells.map(({ box }) => box[k + 3])));
    // Geometry outside of the cells is drawn, too.
    this.far = 10 + 3 * Math.hypot(...high.map((x, k) => x - low[k]));
    this.angle = index.viewpoints[0]?.fieldOfView ?? Math.PI / 3;
    this.#make();
    canvas.addEventListener("webglcontextlost", (event) => {
      event.preventDefault();
      this.memory.lose();
      this.comparison?.memory.lose();
    });
    canvas.addEventListener("webglcontextrestored", () => {
      this.#make();
      this.memory.resume();
      this.#compare();
    });
  }

  /**
   * Reports an error: without the first room, or a decoder, the walk cannot begin; otherwise it goes on.
   * @param {import("./net/errors.js").PageError} error
   * @param {string} kind of the missing file
   * @param {number} number
   */
  #report(error, kind, number) {
    this.faults.push({ code: error.code, message: error.message });
    const room = (kind === "record" || kind === "geometry") && number === this.cell;
    const { previews, workers } = this.stream;
    const decoder = kind === "decoder" && (previews.length === 0 || workers.ended);
    const fatal = !this.begun && (room || decoder);
    this.emit(fatal ? "error" : "notice", error);
  }

  #make() {
    this.renderer?.statues?.delete();
    const { gl, index: { octrees, textures } } = this;
    this.renderer = new Renderer(gl, this.memory, textures);
    const relieved = textures.some((row) => "relief" in row || row.normals);
    if (relieved || octrees) {
      this.#loading = true;
      (relieved ? loadReliefs() : loadStatues())
        .then(({ show }) => show(this, (error) => this.#report(error, "octree", 0)))
        .catch(() => this.emit("notice", { message: page.unloaded }))
        .finally(() => (this.#loading = false));
    }
    this.items = new ItemBuffer(gl);
    this.fence = new Fence(gl);
    this.turn();
  }

  /** The picture has changed. */
  touch() {
    this.#changed = clock();
  }

  /** The view has changed, or its geometry, or what the item buffer is probed for. */
  turn() {
    this.touch();
    this.#turned = this.#changed;
  }

  /** Cells visible from those that the visitor is in, his own first. */
  get visible() {
    const { known, cell } = this.client, here = known[this.cell] ? this.cell : cell;
    if (!known[here]) return this.cell < 0 ? [] : [this.cell];
    const cells = this.locator.around(this.#eye, here);
    // The record of the present cell may be on its way.
    if (this.cell >= 0) cells.push(this.cell);
    return [...new Set(cells.flatMap((c) => known[c]?.visible ?? [c]))];
  }

  /** Vertical field of view, radians: `angle` is the smaller one. */
  get tall() {
    const aspect = this.aspect;
    if (aspect >= 1) return this.angle;
    return Math.min(TALLEST, 2 * Math.atan(Math.tan(this.angle / 2) / aspect));
  }

  get aspect() {
    return this.canvas.width / this.canvas.height;
  }

  /** @param {Pose} pose */
  locate(pose) {
    this.#eye = pose.eye;
    const cell = this.locator.locate(pose.eye, this.cell);
    if (cell >= 0) return this.enter(cell);
    // Among cells without a record, one whose box holds the eye.
    const maybe = this.locator.candidates(pose.eye, this.cell);
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
    const now = clock(), { gl } = this;
    if (gl.isContextLost()) return;
    this.fence?.reached(now);
    // Before anything is uploaded: reading waits for what was begun before it.
    this.#read(now);
    this.locate(pose);
    const { stillness } = this;
    const turns = stillness.takes(pose, now);
    // A canvas of another size is empty.
    const resized = this.sharpness.settle(now - this.#before, now - stillness.moved < RESTING);
    if (turns || resized) this.turn();
    const time = Math.max(UPLOAD_TIME, Math.min(UPLOAD_SHARE * (now - this.#before), UPLOAD_MOST));
    this.#before = now;
    const frustum = frustumOf(pose, this.tall, this.aspect);
    this.#bring(now + time);
    this.#cull(frustum);
    const until = clock() + time, late = () => clock() > until;
    if (this.memory.pump(now, late) || this.comparison?.memory.pump(now, late)) this.touch();
    const { fence, items, renderer } = this;
    if (this.begun) {
      const lines = this.sharpness.lines / Math.tan(this.tall / 2);
      renderer?.statues?.advance(this.drawn, pose.eye, lines, !this.frozen && !document.hidden);
    }
    if (this.stream.news || now - this.#looked >= LOOK_EVERY) this.#look(now, frustum, stillness.lasts(now));
    const camera = cameraOf(pose, this.tall, this.aspect, this.far);
    if (!this.begun) {
      const { progress, over } = beginningOf(this);
      this.emit("progress", progress);
      this.begun = this.#ready && !fence?.busy;
      this.#ready ||= over;
      if (this.begun) this.emit("first-picture", undefined);
    }
    const stands = !turns && stillness.moved < this.#painted;
    const waits = stands && !resized
      && (fence?.busy || items?.busy || now - this.#painted < pause(PAINT_EVERY, fence));
    if ((this.#ready || !this.covered) && this.#changed > this.#painted && !waits) this.#paint(camera, now);
    const every = stands ? pause(ITEM_EVERY, items?.fence) : ITEM_EVERY;
    if (this.#turned > this.#itemDrawn && now - this.#itemDrawn >= every) this.#drawItems(camera, now);
    this.recorder?.frame(now, frustum, this.#sightDrawn);
    this.stream.pump();
  }

  /** Whether to make no requests beyond the screen, or none at all. */
  get #rests() {
    const enough = this.saving || document.hidden || this.comparing;
    return this.frozen || (enough && this.client.missing(true) === 0);
  }

  /** @param {import("./gl/camera.js").Camera} camera @param {number} now */
  #paint(camera, now) {
    const { gl, canvas: { width, height }, comparison } = this;
    this.#painted = now;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, width, height);
    if (this.renderer?.draw(camera, this.drawn, now)) this.touch();
    if (comparison) {
      const half = width >> 1;
      gl.enable(gl.SCISSOR_TEST);
      gl.scissor(half, 0, width - half, height);
      comparison.renderer.draw(camera, this.drawn, now);
      gl.disable(gl.SCISSOR_TEST);
    }
    this.fence?.mark(now);
    this.#frames = [...this.#frames.filter((at) => at > now - 1), now];
  }

  /** @param {boolean} on whether texture memory stays unchanged and no requests are made */
  freeze(on) {
    this.frozen = on;
    if (on) this.memory.hold();
  }

  /** @param {boolean} on whether the right half shows full resolution */
  compare(on) {
    this.comparing = on;
    if (this.gl.isContextLost()) return;
    this.comparison?.delete();
    this.#compare();
  }

  /** Makes the means for a comparison, if there is one. */
  async #compare() {
    this.comparison = null;
    this.touch();
    if (!this.comparing) return;
    const script = await loadComparison().catch(() => null);
    if (!script) {
      this.comparing = false;
      return this.emit("notice", { message: page.unloaded });
    }
    const { Comparison } = script;
    if (!this.comparing || this.comparison || this.gl.isContextLost()) return;
    this.comparison = new Comparison(this);
    this.touch();
  }

  /** @param {string} policy one of `POLICIES` */
  choose(policy) {
    this.policy = policy;
    this.client.policy = POLICIES[policy];
    this.memory = this.#memoryOf(this.memory);
    if (this.renderer) this.renderer.memory = this.memory;
    this.touch();
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

  /** The levels of each texture that the view wants, or null before the first item buffer. */
  get present() {
    return this.#sight?.present ?? null;
  }

  /**
   * Uploads the geometry of visible cells, as long as the frame has time, and frees the others.
   * @param {number} until s
   */
  #bring(until) {
    const { renderer, visible } = this;
    if (!renderer) return;
    renderer.keep(new Set(visible));
    const late = () => clock() > until;
    for (const cell of visible) {
      const shapes = this.stream.shapes.get(cell);
      const before = renderer.cells.get(cell);
      if (!shapes || before?.shapes === shapes) continue;
      if (!renderer.add(cell, shapes, late)) break;
      // None of it may be in view, but now the item buffer has the room.
      if (before || cell === this.cell) this.turn();
      if (late()) break;
    }
  }

  /** Chooses what is drawn, and which cells are missing. @param {import("./space/frustum.js").Frustum} frustum */
  #cull(frustum) {
    [this.drawn, this.#missing] = inView(this, frustum);
    const scene = [this.drawn, this.#missing].map((cells) => cells.map(({ cell }) => cell)).join(";");
    if (scene !== this.#scene) this.turn();
    this.#scene = scene;
  }

  /** @param {import("./gl/camera.js").Camera} camera @param {number} now */
  #drawItems(camera, now) {
    if (!this.items || this.items.busy) return;
    this.#itemDrawn = now;
    this.#drew = this.cell < 0 || this.renderer?.cells.has(this.cell) === true;
    const { textures } = this.index;
    this.items.draw({
      camera,
      aspect: this.aspect,
      lines: this.sharpness.lines,
      now,
      drawn: this.drawn,
      missing: this.#missing,
      sizeOf: (t) => [textures[t].width, textures[t].height],
      probe: this.probe,
    });
  }

  /** @param {number} now */
  #read(now) {
    const reading = this.items?.poll(now);
    if (!reading) return;
    this.#sightDrawn = reading.drawn;
    this.#shown ||= this.#drew;
    if (this.#shown) this.#expected = null;
    this.#see(sightOf(reading, this.catalogue));
  }

  /** @param {import("./policy/sight.js").Sight} sight */
  #see({ present, hidden }) {
    this.#sight = { present: this.#expected ?? present, hidden };
    this.client.sees(this.#sight.present, hidden);
  }

  /** Whether the view is only expected: no item buffer has had the room. */
  get expects() {
    return this.#expected !== null;
  }

  /**
   * @param {number} now
   * @param {import("./space/frustum.js").Frustum} frustum
   * @param {boolean} still
   */
  #look(now, frustum, still) {
    this.#looked = now;
    this.stream.news = false;
    const { client, memory, reserve, comparison } = this;
    client.downloads.now = now;
    if (comparison) comparison.settle();
    if (this.frozen) return;
    reserve.enter(this.cell, this.budget);
    client.budget = this.budget - reserve.bytes;
    client.look({ now, cell: this.cell, frustum, still });
    while (reserve.grow(client.column) && client.fit(this.budget - reserve.bytes));
    memory.budget = this.budget;
    memory.settle(client.column, shares(this), losses(client));
  }

  /** Pictures in the second before the last one. */
  get fps() {
    return this.#frames.length;
  }

  /** Seconds since the item buffer in use was drawn; null before the first. */
  get bufferAge() {
    return this.#sightDrawn < 0 ? null : clock() - this.#sightDrawn;
  }

  /** Whether everything that this view could use within the budget is present, in the best form. */
  get complete() {
    return this.has(true);
  }

  /** Whether that is so, of objects with any mesh and without relief unless `finer`. @param {boolean} finer */
  has(finer) {
    const { client, renderer, stream } = this;
    if (!this.present || this.#sightDrawn < this.#turned || this.#looked < this.#changed) return false;
    if (this.#ready && this.#painted < this.#changed) return false;
    if (this.visible.some((c) => renderer?.cells.get(c)?.shapes !== stream.shapes.get(c))) return false;
    // The walk begins without relief.
    if (finer && (this.#loading || renderer?.statues?.lacks)) return false;
    if (client.cell !== this.cell || client.missing(false, false, finer) > 0) return false;
    return this.sharpness.full && settled(this);
  }

  /** Whether it is complete, with exact texels alone, and no file of it has failed. */
  get exact() {
    return this.complete && this.client.missing(false, true) === 0 && !previewed(this);
  }
}
