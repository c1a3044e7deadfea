// A client on a walk: it keeps account of downloads, and its policy decides from these what should be
// in texture memory and what to request next (docs/formats/client.md).

import { PATIENCE, PATIENCE_STILL } from "./constants.js";
import { Downloads } from "./downloads.js";
import { knownOf, shapesOf } from "./knowledge.js";

/** @typedef {import("./catalogue.js").Catalogue} Catalogue */
/** @typedef {import("./downloads.js").Kind} Kind */
/** @typedef {import("./downloads.js").Request} Request */
/** @typedef {import("./estimate.js").Belief} Belief */
/** @typedef {import("./knowledge.js").Known} Known */
/** @typedef {import("./knowledge.js").CellRecord} CellRecord */
/** @typedef {import("./knowledge.js").Shapes} Shapes */
/** @typedef {import("../space/frustum.js").Frustum} Frustum */
/** @typedef {Float32Array | Float64Array} Shares */

/**
 * A policy of a client.
 * @typedef {object} Policy
 * @property {Int32Array} target (T) columns that it wants to download
 * @property {() => void} look the walker is somewhere: sets `client.column`
 * @property {() => void} learned a record, geometry or item buffer has arrived
 * @property {(estimate: Belief) => Request | null} next
 * @property {(counts: (kind: Kind, number: number) => boolean) => number} missing number of
 *   counted files and levels that are missing
 * @property {() => void} [fit] chooses `client.column` once more at the same look, for another budget
 */

/**
 * The place and the view of the walker.
 * @typedef {object} Look
 * @property {number} now s, on any clock
 * @property {number} cell that the eye is in, −1 if unknown; a missing record is requested, and the
 *   previous cell stays in use until then
 * @property {Frustum} frustum
 * @property {boolean} [still] whether the eye has not moved for a second
 * @property {Shares} [sight] see `sees`
 * @property {Shares} [hidden]
 */

export class Client {
  /** @type {Policy} */
  #policy;

  /**
   * @param {Catalogue} catalogue
   * @param {{budget: number, policy: (client: Client) => Policy}} options bytes of texture memory;
   *   one of `POLICIES`
   */
  constructor(catalogue, { budget, policy }) {
    const { T, C, K } = catalogue;
    this.catalogue = catalogue;
    /** Bytes of texture memory; a change counts from the next look on. */
    this.budget = budget;
    /** (T) the column that each texture should hold in memory. */
    this.column = new Int32Array(T);
    this.downloads = new Downloads(catalogue);
    /** The cell that the eye is in, and the one whose record is used; −1 for none. */
    this.here = -1;
    this.cell = -1;
    this.still = false;
    /** How long a level may take under the paper's policy, s: while the eye moves, and is still. */
    this.patience = { moving: PATIENCE, still: PATIENCE_STILL };
    /** @type {Frustum | null} */
    this.frustum = null;
    /** @type {Shares} (T × K) of the screen that wants each column */
    this.sight = new Float64Array(T * K);
    /** @type {Shares} (C) of the screen that shows the placeholder of each cell */
    this.hidden = new Float64Array(C);
    /** @type {(Known | undefined)[]} by cell */
    this.known = new Array(C).fill(undefined);
    /** @type {(Shapes | undefined)[]} by cell; they stay when geometry is forgotten */
    this.shapes = new Array(C).fill(undefined);
    /** (C) cells whose geometry was dropped: it is requested only when it may be seen again. */
    this.left = new Uint8Array(C);
    this.#policy = policy(this);
  }

  /** Another policy continues with the downloaded data. @param {(client: Client) => Policy} policy */
  set policy(policy) {
    this.#policy = policy(this);
  }

  /** (T) columns of `.ptm`s that are downloaded whole. */
  get have() {
    return this.downloads.have;
  }

  /** (T) columns that it wants to download. */
  get target() {
    return this.#policy.target;
  }

  /** @param {number} cell @param {CellRecord} record */
  learnRecord(cell, record) {
    this.known[cell] = knownOf(record);
    this.downloads.came("record", cell);
    this.#policy.learned();
  }

  /**
   * @param {number} cell
   * @param {{texture: number, light?: number, probe?: number, low: number[], high: number[]}[]} shapes
   */
  learnGeometry(cell, shapes) {
    this.shapes[cell] = shapesOf(shapes);
    this.left[cell] = 0;
    this.downloads.came("geometry", cell);
    this.#policy.learned();
  }

  /**
   * Forgets the geometry of a cell: its bytes are gone. Its boxes still serve for distances. (Geometry
   * that only leaves the GPU need not be forgotten.)
   * @param {number} cell
   */
  forgetGeometry(cell) {
    this.left[cell] = 1;
    this.downloads.lost("geometry", cell);
    this.#policy.learned();
  }

  /**
   * Receives an item buffer.
   * @param {Shares} sight (T × K) the share of its pixels that wants each column
   * @param {Shares} hidden (C) the share that shows the placeholder of each cell
   */
  sees(sight, hidden) {
    this.sight = sight;
    this.hidden = hidden;
    this.#policy.learned();
  }

  /** Chooses `column`. @param {Look} look */
  look({ now, cell, frustum, still = false, sight = this.sight, hidden = this.hidden }) {
    if (cell >= 0) this.here = cell;
    if (this.known[this.here]) this.cell = this.here;
    Object.assign(this, { frustum, still });
    this.downloads.now = now;
    this.sees(sight, hidden);
    this.#policy.look();
  }

  /**
   * Sets another budget at the same look; false if the policy adapts gradually.
   * @param {number} bytes
   */
  fit(bytes) {
    this.budget = bytes;
    if (!this.#policy.fit) return false;
    this.#policy.fit();
    return true;
  }

  /**
   * Number of files and levels that this view could use within the budget and that are missing.
   * @param {boolean} [free] whether to omit those that are requested already or cannot be now
   * @param {boolean} [gone] whether to count those that are unavailable
   * @param {boolean} [finer] whether to count finer meshes
   */
  missing(free = false, gone = false, finer = true) {
    const { downloads } = this;
    return this.#policy.missing((kind, number) => kind === "mesh" && !finer ? false :
      free ? downloads.free(kind, number) : gone || !downloads.gone(kind, number));
  }

  /**
   * The next request, which then counts as made; to be called until it is null.
   * @param {Belief} estimate
   */
  next(estimate) {
    return this.here < 0 || !this.frustum ? null : this.#policy.next(estimate);
  }

  /**
   * A request is finished. `learnRecord` and `learnGeometry` take the contents of records and
   * geometry; of a texture the bytes up to `end` have arrived, whether the response broke off or
   * the server sent more.
   * @param {Request} request
   */
  arrived(request, end = request.end) {
    this.downloads.over(request, end);
  }

  /**
   * A request failed and may be made again, though not before `until`, s.
   * @param {Request} request
   */
  failed(request, until = 0) {
    this.downloads.failed(request, until);
  }

  /**
   * Forgets a preview that cannot be shown; it may be requested from `until` on, s.
   * @param {number} preview
   * @param {number} until
   */
  losePreview(preview, until = 0) {
    this.downloads.drop(preview, until);
  }

  /**
   * Keeps only the first bytes of a texture; more may be requested from `until` on, s.
   * @param {number} texture
   * @param {number} bytes
   * @param {number} until
   */
  lose(texture, bytes, until = 0) {
    this.downloads.cut(texture, bytes, until);
  }
}
