// A walk through a database: shows the cells that the hints of the viewer's cell list as visible
// (docs/formats/hints.md).

import { ClampToEdgeWrapping, Group } from "three";
import { Locator, levelSizes } from "ptm-client";
import { DecoderWorkers } from "ptm-decoder";
import { shareOut } from "./budget.js";
import { CellLoader, disposeCell, disposeMesh } from "./cell-loader.js";
import { ease, surroundingsOf } from "./light.js";
import { PtmTexture } from "./ptm-texture.js";
import { RangeFile } from "./range-file.js";

/** @typedef {import("three").Vector3} Vector3 */

/**
 * @typedef {object} Index `hints.json`, as far as it is used here
 * @property {number} schema
 * @property {string} [record]
 * @property {{gltf?: string}} [geometry]
 * @property {{position: number[], direction: number[], fieldOfView: number, cell: number,
 *   description: string}[]} viewpoints
 * @property {{file: string, width: number, height: number, ends: number[], color?: number[],
 *   components?: number, offsets?: number[], previews?: {file: string, level: number, width: number,
 *   height: number, bytes: number, exact?: boolean}[], light?: number, relief?: string,
 *   normals?: boolean, probe?: import("./light.js").Probe}[]} textures
 * @property {{name: string, box: number[], record?: string, geometry?: string, exposure?: number[]}[]} cells
 * @property {import("./light.js").Light} [light]
 * @property {{cell: number, files: string[]}[]} [meshes] objects with levels of detail
 */

/**
 * @typedef {object} CellRecord
 * @property {number[]} visible
 * @property {number[]} adjacent
 * @property {number[]} ach
 * @property {number} floor
 * @property {number[][]} textures
 * @property {{points: number[][], faces: number[][]}[]} leaves
 * @property {{neighbour: number, polygon: number[][], passage?: boolean}[]} portals
 */

/**
 * @typedef {object} WalkOptions
 * @property {number} [budget] texture memory, bytes; 256 MiB
 * @property {number} [connections] requests at a time; 4, as browsers open six over HTTP/1.1
 * @property {DecoderWorkers} [workers] that decode; its own, unless given
 * @property {boolean} [reflections] false: nothing reflects, and no probes are loaded
 * @property {(error: unknown) => void} [onError] called for a file that cannot be loaded
 */

/**
 * A cell that is loaded or on its way.
 * @typedef {object} Loaded
 * @property {AbortController} control
 * @property {Promise<Group | undefined>} done
 * @property {Map<number, Promise<void>>} meshes objects as modelled, by their place in the index
 */

/** Weight of normal maps beside textures, and share of the view of a surface without texture that has one. */
const NORMALS = 0.25, PLAIN_SHARE = 0.01;
/** Texels of a side to which all textures are refined before any is refined further. */
const FIRST_LOOK = 64;
/** Metres between two calls of `update` that are a jump. */
const JUMP = 1;

/** Shows the cells visible from a cell and frees the others: see `update` and `enter`. */
export class Walk {
  /** Everything that can be seen from the cell; to be added to a scene. */
  shown = new Group();
  /** The cell that the viewer is in, -1 at first. */
  cell = -1;
  /** This cell and those beyond near passages. @type {number[]} */
  #around = [];
  #renderer;
  #url;
  #options;
  #ownWorkers;
  #loader;
  /** That of lit surfaces; where the viewer was, and when, ms; and whether by a jump to an unknown cell. */
  #exposure = { value: [1, 1, 1] };
  #place = [Infinity];
  #before = 0;
  #jumped = true;
  #locator;
  /** @type {Map<number, Promise<CellRecord>>} */
  #records = new Map();
  /** @type {Map<number, Loaded>} */
  #cells = new Map();
  /** The file of each texture and its copies, by wraps.
   * @type {Map<number, {file: RangeFile, copies: Map<string, PtmTexture>}>} */
  #textures = new Map();
  /** The textures beside each normal map of materials; -1 for none. @type {Map<number, Set<number>>} */
  #beside = new Map();
  #entered = new AbortController();
  #locating = false;

  /**
   * Fetches an index: `hints.json` of a database that is served, or the index of a site.
   * @param {import("three").WebGLRenderer} renderer
   * @param {string | URL} url
   * @param {WalkOptions} [options]
   */
  static async open(renderer, url, options) {
    const index = await json(new URL(url, globalThis.document?.baseURI));
    return new Walk(renderer, index, url, options);
  }

  /**
   * Throws an Error if the hints are of another schema.
   * @param {import("three").WebGLRenderer} renderer
   * @param {Index} index
   * @param {string | URL} url of the index
   * @param {WalkOptions} [options]
   */
  constructor(renderer, index, url, options = {}) {
    if (index.schema !== 3) throw new Error(`hints of schema ${index.schema}, not 3`);
    this.index = index;
    this.budget = options.budget ?? 2 ** 28;
    /** Sky and ground of a building with light, to be added to a scene; or null. */
    this.surroundings = index.light ? surroundingsOf(index.light, this.#exposure) : null;
    const probeOf = (/** @type {number} */ number) => (options.reflections === false ? null : this.#probe(number));
    this.#loader = new CellLoader((...which) => this.#texture(...which), index.light, this.#exposure, probeOf);
    this.#locator = new Locator(index.cells.map(({ box }) => box));
    this.#renderer = renderer;
    this.#url = new URL(url, globalThis.document?.baseURI);
    this.#options = options;
    this.#ownWorkers = options.workers ? undefined : new DecoderWorkers();
  }

  /** Factors of red, green and blue light in the picture. */
  get exposure() {
    return this.#exposure.value;
  }

  /** The exposure of the viewer's cell; of an eye in none, as it is. */
  get #target() {
    return this.cell < 0 ? this.exposure : (this.index.cells[this.cell].exposure ?? [1, 1, 1]);
  }

  /** Bytes of all textures on the GPU. */
  get gpuBytes() {
    return this.textures.reduce((sum, { texture }) => sum + texture.gpuBytes, 0);
  }

  /** The present textures, with their numbers in the index. */
  get textures() {
    return [...this.#textures].flatMap(([number, { copies }]) =>
      [...copies.values()].map((texture) => ({ number, texture })),
    );
  }

  /**
   * To be called in each frame: eases the exposure to that of the viewer's cell, and enters the cell that
   * holds the viewer, with those beyond near door leaves, if they have changed.
   * @param {Vector3} position
   */
  async update(position) {
    const place = position.toArray(), now = performance.now();
    this.#jumped ||= !(Math.hypot(...place.map((x, k) => x - this.#place[k])) < JUMP);
    ease(this.#exposure, this.#target, (now - this.#before) / 1000);
    [this.#place, this.#before] = [place, now];
    if (this.#locating) return;
    this.#locating = true;
    const jumped = this.#jumped;
    this.#jumped = false;
    const cell = await this.locate(position)
      .catch((error) => (this.#report(error), -1))
      .finally(() => (this.#locating = false));
    this.#jumped ||= jumped && cell < 0;
    if (cell < 0) return;
    const around = this.#locator.around(position.toArray(), cell);
    const entered = around.join() === this.#around.join() ? null : this.#enter(around);
    if (jumped) this.#exposure.value = this.#target;
    await entered;
  }

  /**
   * The cell that holds a point, or -1. Fetches the records of cells whose box holds it until one is
   * the cell.
   * @param {Vector3} point
   */
  async locate(point) {
    const eye = point.toArray();
    for (;;) {
      const cell = this.#locator.locate(eye, this.cell);
      const [unknown] = this.#locator.candidates(eye, this.cell);
      if (cell >= 0 || unknown === undefined) return cell;
      await this.#record(unknown);
    }
  }

  /**
   * Frees cells out of sight, fetches visible ones, and distributes texture memory by coverage of the view.
   * Cancels requests of the cell entered before.
   * @param {number} cell
   * @param {number} [budget] texture memory, bytes, from now on
   * @returns {Promise<boolean>} whether everything is loaded; false if another cell was entered since
   */
  async enter(cell, budget = this.budget) {
    this.budget = budget;
    const entered = this.#enter([cell]);
    this.#exposure.value = this.#target;
    return entered;
  }

  /** @param {number[]} around the viewer's cell, then those beyond near passages */
  async #enter(around) {
    this.#entered.abort();
    const { signal } = (this.#entered = new AbortController());
    [this.cell] = this.#around = around;
    try {
      // Neighbours whose record fails are left out.
      const [own, ...near] = around.map((cell) => this.#record(cell));
      const others = near.map((record) => record.catch((error) => this.#report(error)));
      const records = (await Promise.all([own, ...others])).filter((record) => record !== undefined);
      if (signal.aborted) return false;
      const shares = sharesOf(records), cells = new Set(records.flatMap(byCoverage));
      this.#free(cells, this.#withNormals(shares));
      await this.#all([...cells].map((cell) => () => this.#load(cell)), signal);
      if (!signal.aborted) await this.#refine(this.#withNormals(shares), signal);
      const textures = this.#textures.size;
      await this.#all([...cells].flatMap((cell) => this.#coarse(cell)), signal);
      if (!signal.aborted && this.#textures.size > textures) await this.#refine(this.#withNormals(shares), signal);
    } catch (error) {
      this.#report(error);
    }
    return !signal.aborted;
  }

  /**
   * The shares with those of normal maps, which records do not list: a part of that of the texture beside them.
   * @param {Map<number, number>} shares
   */
  #withNormals(shares) {
    const all = new Map(shares);
    for (const [number, beside] of this.#beside) {
      for (const texture of beside) {
        const share = texture < 0 ? PLAIN_SHARE : shares.get(texture);
        if (share !== undefined) all.set(number, Math.max(all.get(number) ?? 0, NORMALS * share));
      }
    }
    return all;
  }

  /** Frees everything; the walk cannot be used any more. */
  dispose() {
    this.#entered.abort();
    this.#free(new Set(), new Map());
    this.surroundings?.geometry.dispose();
    this.surroundings?.material.dispose();
    this.#ownWorkers?.close();
  }

  /** @param {unknown} error */
  #report(error) {
    (this.#options.onError ?? console.error)(error);
  }

  /** @param {number} cell */
  #record(cell) {
    const read = async () => {
      /** @type {CellRecord} */
      const record = await json(this.#address(cell, "record"));
      this.#locator.learn(cell, record);
      return record;
    };
    const record = this.#records.get(cell) ?? read();
    this.#records.set(cell, record);
    record.catch(() => this.#records.delete(cell));
    return record;
  }

  /**
   * @param {number} cell
   * @param {"record" | "geometry"} kind
   */
  #address(cell, kind) {
    const row = this.index.cells[cell];
    const template = kind === "record" ? this.index.record : this.index.geometry?.gltf;
    const url = row[kind] ?? template?.replace("{name}", row.name);
    if (url === undefined) throw new Error(`${this.#url}: cells without ${kind} as glTF`);
    return new URL(url, this.#url);
  }

  /** @param {number} cell @returns {Promise<unknown>} */
  #load(cell) {
    const loading = this.#cells.get(cell);
    if (loading) return loading.done;
    const control = new AbortController();
    const load = async () => {
      try {
        const url = this.#address(cell, "geometry");
        const group = await this.#loader.load(url, control.signal);
        control.signal.addEventListener("abort", () => disposeCell(group));
        this.shown.add(group);
        return group;
      } catch (error) {
        if (control.signal.aborted) return;
        this.#cells.delete(cell);
        throw error;
      }
    };
    const done = load();
    this.#cells.set(cell, { control, done, meshes: new Map() });
    return done;
  }

  /**
   * What loads the objects of a cell as modelled, of those that it has simplified meshes of.
   * @param {number} cell
   */
  #coarse(cell) {
    const place = this.#cells.get(cell);
    if (!place) return [];
    return (this.index.meshes ?? []).flatMap((row, mesh) => {
      if (row.cell !== cell) return [];
      const load = () => this.#model(place, mesh, row.files[row.files.length - 1]);
      return [
        () => {
          const done = place.meshes.get(mesh) ?? load();
          place.meshes.set(mesh, done);
          return done;
        },
      ];
    });
  }

  /**
   * Puts an object as modelled in place of its coarsest mesh.
   * @param {Loaded} place
   * @param {number} mesh
   * @param {string} file
   */
  async #model({ control: { signal }, done, meshes }, mesh, file) {
    try {
      const coarse = await done;
      const group = await this.#loader.load(new URL(file, this.#url), signal);
      signal.addEventListener("abort", () => disposeCell(group));
      if (coarse) disposeMesh(coarse, mesh);
      this.shown.add(group);
    } catch (error) {
      meshes.delete(mesh);
      if (!signal.aborted) throw error;
    }
  }

  /**
   * @param {number} number
   * @param {number} wrapS
   * @param {number} wrapT
   * @param {number} [beside] the texture beside a normal map
   */
  #texture(number, wrapS, wrapT, beside) {
    if (beside !== undefined) this.#beside.set(number, (this.#beside.get(number) ?? new Set()).add(beside));
    const row = this.index.textures[number], { file, ends, color, components, offsets } = row;
    const light = row.light !== undefined, probe = row.probe !== undefined;
    const slot = this.#textures.get(number) ?? {
      file: new RangeFile(new URL(file, this.#url)),
      copies: new Map(),
    };
    this.#textures.set(number, slot);
    const workers = this.#options.workers ?? this.#ownWorkers;
    const previews = row.previews?.map((one) => ({ ...one, file: new URL(one.file, this.#url) }));
    const sizes = levelSizes(row);
    const linear = light || probe || row.relief !== undefined || beside !== undefined, channel = +light;
    const options = { workers, ends, color, components, offsets, previews, sizes, wrapS, wrapT, linear, channel };
    const texture =
      slot.copies.get(`${wrapS} ${wrapT}`) ?? new PtmTexture(this.#renderer, slot.file, options);
    slot.copies.set(`${wrapS} ${wrapT}`, texture);
    return texture;
  }

  /** @param {number} number of a texture */
  #probe(number) {
    const row = this.index.textures[number], { probe, color = [255, 255, 255] } = row;
    const texture = probe && this.#texture(number, ClampToEdgeWrapping, ClampToEdgeWrapping);
    return texture ? { probe, texture, color, levels: levelSizes(row).length } : null;
  }

  /**
   * @param {Set<number>} cells those that stay
   * @param {Map<number, number>} textures those that stay
   */
  #free(cells, textures) {
    for (const [cell, { control }] of this.#cells) {
      if (cells.has(cell)) continue;
      control.abort();
      this.#cells.delete(cell);
    }
    for (const [number, { copies }] of this.#textures) {
      if (textures.has(number)) continue;
      for (const texture of copies.values()) texture.dispose();
      this.#textures.delete(number);
    }
  }

  /**
   * Textures with too many levels shrink before any grows; then all get coarse levels; then the rest by
   * previews; then exactly. The greatest coverage begins. Probes have all levels or none.
   * @param {Map<number, number>} shares
   * @param {AbortSignal} signal
   */
  async #refine(shares, signal) {
    const wants = [...this.#textures].map(([number, { copies }]) => {
      const row = this.index.textures[number], sizes = levelSizes(row), whole = row.probe !== undefined;
      const share = shares.get(number) ?? 0;
      return { sizes, share, whole, copies: copies.size, all: [...copies.values()] };
    });
    const levels = shareOut(wants, this.budget);
    const order = [...wants.keys()].sort((a, b) => wants[b].share - wants[a].share);
    /** @param {(n: number, now: number) => number} target @param {boolean} exact */
    const pass = (target, exact) =>
      this.#all(
        order.map((n) => async () => {
          // One after the other: the second uses the bytes of the first.
          for (const texture of wants[n].all) {
            const level = target(n, texture.level), { whole, sizes } = wants[n];
            await texture.refine(whole && level < sizes.length - 1 ? -1 : level, { exact });
          }
        }),
        signal,
      );
    await pass((n, now) => Math.min(levels[n], now), false);
    await pass((n, now) => {
      const sides = wants[n].sizes.map(({ width, height }) => Math.max(width, height));
      const first = sides.findLastIndex((side) => side <= FIRST_LOOK);
      return Math.min(levels[n], Math.max(first, now, 0));
    }, false);
    await pass((n) => levels[n], false);
    await pass((n) => levels[n], true);
  }

  /**
   * Runs jobs in order, a few at a time; errors are reported.
   * @param {(() => Promise<unknown>)[]} jobs
   * @param {AbortSignal} signal
   */
  async #all(jobs, signal) {
    const left = [...jobs];
    const lane = async () => {
      for (let job; !signal.aborted && (job = left.shift()); ) {
        await job().catch((error) => this.#report(error));
      }
    };
    await Promise.all(Array.from({ length: this.#options.connections ?? 4 }, lane));
  }
}

/**
 * The share of the view covered by the cells that use each texture.
 * @param {CellRecord[]} records
 */
function sharesOf(records) {
  /** @type {Map<number, number>} */
  const shares = new Map();
  for (const { ach, floor, textures } of records) {
    textures.forEach((used, k) => {
      for (const t of used) shares.set(t, (shares.get(t) ?? 0) + Math.max(ach[k], floor));
    });
  }
  return shares;
}

/** The cells visible from one, by their coverage. @param {CellRecord} record */
function byCoverage({ visible, ach }) {
  return [...visible.keys()].sort((a, b) => ach[b] - ach[a]).map((n) => visible[n]);
}

/** @param {URL} url */
async function json(url) {
  const response = await fetch(url);
  if (!response.ok) throw new Error(`${url}: ${response.status} ${response.statusText}`);
  return response.json();
}
