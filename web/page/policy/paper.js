// The client of Marvie & Bouatouch, §6.1 and §6.2, as `ptm simulate --policy paper` reads them:
// memory is divided among the cells in the frustum by their average coverage, and equally among the
// shapes of each; a texture adds, removes or requests one level at each look, if it can arrive
// within the patience of the visitor. Requests are made at once. The paper has no previews: they serve
// only for levels finer than those of the `.ptm`, the coarsest first.

import { AHEAD, BEFORE } from "./constants.js";
import { duration } from "./estimate.js";
import { boxed, lacking, modelled } from "./files.js";
import { refresh, shareOut } from "./sharing.js";
import { meetsBox, meetsHull } from "../space/frustum.js";
import { nextCell } from "../space/portals.js";

/** @typedef {import("./client.js").Client} Client */
/** @typedef {import("./client.js").Policy} Policy */
/** @typedef {import("./downloads.js").Kind} Kind */
/** @typedef {import("./estimate.js").Belief} Belief */

// Priorities of requests.
const LEVEL = 1, NEXT = 2, VISIBLE = 3, CURRENT = 4;

/** @implements {Policy} */
export class Paper {
  #client;
  #entered = -1;
  /** @type {Set<number>} textures that the visible set uses */
  #used = new Set();
  /** @type {number[]} textures that want their next level; those of them not considered yet */
  #asks = [];
  /** @type {number[]} */
  #due = [];
  /** @type {{now: number, eye: number[]}[]} recent places */
  #way = [];

  /** @param {Client} client */
  constructor(client) {
    this.#client = client;
    this.target = client.column;
  }

  learned() {}

  look() {
    const { catalogue, cell, column, budget, downloads, frustum, known } = this.#client;
    const here = known[cell];
    if (!frustum) return;
    this.#way.push({ now: downloads.now, eye: frustum.eye });
    while (this.#way[0].now < downloads.now - BEFORE - 1e-9) this.#way.shift();
    if (!here) return;
    if (cell !== this.#entered) {
      // Textures that the visible set of the new cell does not use are dropped.
      this.#entered = cell;
      this.#used = new Set(here.textures);
      column.forEach((_, t) => this.#used.has(t) || (column[t] = 0));
    }
    const share = new Float64Array(catalogue.T);
    shareOut(catalogue, this.#shown(), column, budget, share);
    const { stored } = catalogue;
    const have = this.#client.have.map((k, t) => (k < stored[t] ? k : downloads.reach(t).last));
    this.#asks = refresh(catalogue, share, have, budget, column).filter((t) => this.#used.has(t));
    this.#due = [...this.#asks];
  }

  /** The cells in the frustum, by descending hint. */
  #shown() {
    const { cell, frustum, known, shapes, downloads } = this.#client;
    const here = known[cell], cells = [];
    if (!here || !frustum) return [];
    for (const [i, c] of here.visible.entries()) {
      const some = shapes[c], hull = known[c]?.hull;
      if (!some || !downloads.has("geometry", c)) continue;
      if (c !== cell && !(hull ? meetsHull(frustum, hull) : boxed(this.#client, c))) continue;
      const { textures, boxes } = some;
      const ahead = textures.filter((_, s) => meetsBox(frustum, boxes, boxes, 6 * s, 6 * s + 3));
      cells.push({ weight: here.coverage[i], textures: ahead });
    }
    return cells.sort((a, b) => b.weight - a.weight);
  }

  /** @param {(kind: Kind, number: number) => boolean} counts */
  missing(counts) {
    const levels = this.#asks.filter((t) => counts(...this.#nextOf(t)));
    return lacking(this.#client, counts) + levels.length;
  }

  /**
   * The file that has the next level of a texture.
   * @param {number} t
   * @returns {[Kind, number]}
   */
  #nextOf(t) {
    const { catalogue: { stored, previews: { first, column } }, have, downloads } = this.#client;
    if (have[t] < stored[t]) return ["texture", t];
    let p = first[t];
    while (column[p] <= downloads.reach(t).last && p < first[t + 1] - 1) p++;
    return ["preview", p];
  }

  /** @param {Belief} estimate */
  next(estimate) {
    const { cell, here, known } = this.#client;
    const own = known[cell];
    /** @type {[Kind, number, number][]} */
    const files = [["record", here, CURRENT], ["geometry", here, CURRENT]];
    if (own) {
      for (const c of own.visible) files.push(["geometry", c, VISIBLE]);
      const following = this.#following();
      for (const k of modelled(this.#client)) files.push(["mesh", k, VISIBLE]);
      if (following >= 0) files.push(["record", following, NEXT], ["geometry", following, NEXT]);
    }
    return this.#first(files) ?? this.#level(estimate);
  }

  /**
   * Requests the first missing file; those on the way may become more urgent.
   * @param {[Kind, number, number][]} files
   */
  #first(files) {
    const { downloads } = this.#client;
    for (const [kind, number, priority] of files) {
      if (downloads.free(kind, number)) return downloads.ask(kind, number, priority);
      for (const request of downloads.waiting) {
        if (request.kind === kind && request.number === number) {
          request.priority = Math.max(request.priority, priority);
        }
      }
    }
    return null;
  }

  /** @param {Belief} estimate */
  #level(estimate) {
    const { catalogue, downloads, have, patience, still } = this.#client;
    const most = still ? patience.still : patience.moving;
    while (this.#due.length > 0) {
      const t = this.#due.splice(0, 1)[0], [kind, number] = this.#nextOf(t);
      const end = kind === "preview" ? catalogue.previews.bytes[number]
        : catalogue.ends[t * catalogue.K + have[t] + 1];
      const left = kind === "preview" ? end : end - downloads.bytes[t];
      if (duration(estimate, left) <= most && downloads.free(kind, number)) {
        return downloads.ask(kind, number, LEVEL, end);
      }
    }
    return null;
  }

  /** The cell behind the first portal on the extrapolated way, or −1. */
  #following() {
    const { cell, known } = this.#client;
    const first = this.#way[0], last = this.#way[this.#way.length - 1], here = known[cell];
    if (!here || first === last) return -1;
    const ahead = AHEAD / (last.now - first.now);
    return nextCell(here.portals, last.eye, last.eye.map((x, i) => (x - first.eye[i]) * ahead));
  }
}
