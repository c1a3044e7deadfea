// The application: what the interface, tests and users of the console (`window.ptm`) call.

import { loadLater } from "./load-later.js";
import { clock } from "./net/fetcher.js";
import { loadPolicy } from "./policy/policies.js";
import { Recorder } from "./recorder.js";
import { stateOf } from "./state.js";
import { poseOf } from "./ui/address.js";
import { Solids } from "./walk/solids.js";
import { Walker } from "./walk/walker.js";
import { Walkthrough } from "./walkthrough.js";
import { page } from "./words/english.js";

/** Default bytes of texture memory: on desks, and on phones. */
const BUDGET = 256 << 20, SMALL_BUDGET = 64 << 20;
/** The most MiB that a visitor may set. */
const MOST = 4096;
/** Seconds of a frame for collision geometry. */
const SOLID_TIME = 0.004;
/** The longest step of a walk, s: a hidden tab does not walk. */
const LONGEST = 0.1;

/** @typedef {import("./walk/walker.js").Pose} Pose */
/** @typedef {import("./ui/all.js").Events} Events */
/** @typedef {import("./stream.js").Decoders} Decoders */

export class App {
  /** @type {Map<string, ((detail: any) => void)[]>} */
  #listeners = new Map();
  /** What `?memory=auto` measured. @type {import("./measuring.js").Measured | null} */
  measured = null;
  /** The tour, once it is there. @type {import("./tour/tour.js").Tour | null} */
  tour = null;
  /** The policy that was chosen last; it may be on its way. */
  #wanted = "";

  /**
   * @param {HTMLCanvasElement} canvas
   * @param {WebGL2RenderingContext} gl
   * @param {import("./data/site.js").Site} site
   * @param {import("./data/site.js").SiteConfig} config
   * @param {Decoders} decoders
   * @param {object} begin
   * @param {import("./net/opening.js").Opening | null} begin.opening of the view that the address leads to
   * @param {string} begin.policy one of `POLICIES`
   * @param {boolean} begin.low whether nothing reflects
   */
  constructor(canvas, gl, site, config, decoders, { opening, policy, low }) {
    const query = new URLSearchParams(location.search);
    const small = matchMedia("(pointer: coarse)").matches;
    const megabytes = Number(query.get("memory"));
    this.canvas = canvas;
    this.config = config;
    this.index = site.index;
    const options = {
      decoders,
      opening,
      covered: Boolean(config.poster),
      policy,
      low,
      budget: megabytes > 0 ? Math.min(megabytes, MOST) * 2 ** 20 : small ? SMALL_BUDGET : BUDGET,
    };
    const walk = (this.walk = new Walkthrough(canvas, gl, site, options, this.emit));
    const { connection } = /** @type {{connection?: {saveData?: boolean}}} */ (navigator);
    walk.stream.saving = connection?.saveData === true;
    walk.memory.fades = !matchMedia("(prefers-reduced-motion: reduce)").matches;
    if (query.get("memory") === "auto") this.on("first-picture", () => this.#measure());
    this.solids = new Solids();
    /** @param {number[]} eye */
    const locate = (eye) => walk.stream.locator.locate(eye, walk.cell);
    const avatar = site.index.avatarSize;
    this.walker = new Walker({ solids: this.solids, locate, avatar });
    this.goTo(0);
    const linked = poseOf(location.hash);
    // Listeners are added after this.
    if (linked) queueMicrotask(() => this.follow(linked));
  }

  /** Goes to the pose of a link, if it is inside the building. @param {Pose} pose */
  follow(pose) {
    const { low, high, C } = this.walk.client.catalogue;
    for (let c = 0; c < C; c++) {
      if (pose.eye.every((x, k) => low[3 * c + k] <= x && x <= high[3 * c + k])) {
        return this.goTo(pose);
      }
    }
    this.emit("notice", { message: page.outside });
  }

  /**
   * @template {keyof Events} K
   * @param {K} name
   * @param {(detail: Events[K]) => void} listener
   */
  on(name, listener) {
    this.#listeners.set(name, [...(this.#listeners.get(name) ?? []), listener]);
  }

  /**
   * @template {keyof Events} K
   * @param {K} name
   * @param {Events[K]} detail
   */
  emit = (name, detail) => {
    for (const listener of this.#listeners.get(name) ?? []) listener(detail);
  };

  /** All errors, in order. */
  get errors() {
    return this.walk.faults;
  }

  /** The numbers of the overlay. */
  state() {
    return { ...stateOf(this.walk), pose: this.walker.pose };
  }

  /** @param {number | Pose} place a viewpoint, or a pose */
  goTo(place) {
    const { walk, walker, index } = this;
    if (typeof place === "number") {
      const { position, direction: [x, y, z], cell } = index.viewpoints[place];
      walk.enter(cell);
      walker.place({ eye: [...position], yaw: Math.atan2(-x, -z), pitch: Math.asin(y) });
    } else {
      walker.place(place);
    }
    walk.picture.touch();
  }

  /** @param {number} bytes of texture memory */
  setBudget(bytes) {
    this.walk.budget = bytes;
  }

  /** Measures the budget of texture memory. */
  #measure() {
    loadLater().then(async ({ measureBudget }) => (this.measured = await measureBudget(this)))
      .catch(() => this.emit("notice", { message: page.unloaded }));
  }

  /** @param {number} seconds that a level may take while one moves: §6.2's δt */
  setPatience(seconds) {
    this.walk.client.patience.moving = seconds;
  }

  /** @param {string} name of a policy */
  async setPolicy(name) {
    this.#wanted = name;
    const known = await loadPolicy(name).catch(() => {
      this.emit("notice", { message: page.unloaded });
    });
    if (known && this.#wanted === name) this.walk.choose(name);
  }

  /** @param {boolean} on whether texture memory stays as it is */
  freeze(on) {
    this.walk.freeze(on);
  }

  /** @param {boolean} on whether the right half shows full resolution */
  compare(on) {
    this.walk.compare(on);
  }

  /** @param {boolean} on whether only visible textures and cells are fetched */
  setDataSaver(on) {
    this.walk.stream.saving = on;
  }

  /** Records the walk from now on. */
  record() {
    this.walk.recorder = new Recorder(this.walk);
  }

  /** The recording, as `ptm simulate --walk` reads it, or null. */
  get recording() {
    return this.walk.recorder?.document ?? null;
  }

  /** The data of the map: the cells, the visitor's cell, and the cells visible from it. */
  plan() {
    const { walk, index } = this;
    const cells = index.cells.map(({ box }, cell) => {
      const leaves = walk.stream.records.get(cell)?.leaves;
      return { cell, low: box.slice(0, 3), high: box.slice(3), leaves };
    });
    return { cells, here: walk.cell, visible: walk.visible };
  }

  /**
   * Computes a frame: the step of the walker, then the picture and the requests.
   * @param {number} dt s
   * @param {import("./walk/walker.js").Wishes} wishes
   */
  frame(dt, wishes) {
    this.#solidify();
    this.walker.step(Math.min(dt, LONGEST), wishes);
    this.walk.frame(this.walker.pose);
  }

  /** Adds collision geometry of the cell and its neighbours, as long as the frame has time. */
  #solidify() {
    const until = clock() + SOLID_TIME, late = () => clock() > until;
    const { walk, solids } = this, { records, shapes } = walk.stream;
    const record = records.get(walk.cell);
    solids.keep(new Set([...walk.visible, ...(record?.adjacent ?? [])]));
    for (const cell of record ? [walk.cell, ...record.adjacent] : []) {
      const its = records.get(cell), geometry = shapes.get(cell);
      if (!its || !geometry || solids.has(cell, geometry)) continue;
      if (!solids.add(cell, geometry, its, late) || late()) return;
    }
  }
}
