// The body of a visitor with a headset. It stands under the head: steps in the room are steps in the building, as
// long as walls let the head through; sticks walk with the collisions of the page and turn by 30 degrees at once,
// since turning smoothly makes many people sick.

import { axesOf, headingOf, turned } from "./eyes.js";
import { stepOf } from "./head.js";

/** @typedef {import("./eyes.js").Eye} Eye */

/** Radians of a turn; of a stick, the push that turns, and below which the next may follow. */
const TURN = Math.PI / 6, PUSHED = 0.7, LET_GO = 0.3;
/** The push of a stick that counts as none. */
const REST = 0.15;

/** @param {number} push */
const beyond = (push) => (Math.abs(push) < REST ? 0 : push);

/** The last four axes of a controller of WebXR are those of its stick, the first two of a touch pad.
 * @param {{gamepad?: {axes: readonly number[]} | null}} source */
const stickOf = ({ gamepad }) => (gamepad?.axes.length ? gamepad.axes.slice(-2) : [0, 0]);

export class Body {
  /** From the room to the building. */
  yaw = 0;
  /** Whether a controller's main button is held, which walks. */
  pressed = false;
  #ready = true;
  /** Whether the head looks where the walker does, from the next step on. */
  #faces = true;
  /** Of the head in the room. @type {number[]} */
  #place = [0, 0, 0];
  /** @type {number[][]} */
  #axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];

  /** @param {import("../walk/walker.js").Walker} walker @param {boolean} floored whether heights are above the floor */
  constructor(walker, floored) {
    this.walker = walker;
    this.floored = floored;
  }

  /** Turns the room so that the head looks where the walker does. */
  face() {
    this.#faces = true;
  }

  /**
   * Follows the head, and returns what the sticks wish.
   * @param {ArrayLike<number>} head its matrix in the room
   * @param {Iterable<{handedness: string, gamepad?: any}>} sources
   */
  follow(head, sources) {
    const { walker: { pose } } = this, before = this.#place;
    this.#axes = axesOf(head);
    const { yaw } = headingOf(this.#axes);
    this.#place = [head[12], head[13], head[14]];
    if (this.#faces) this.yaw = pose.yaw - yaw;
    else {
      const [x, , z] = turned(this.#place.map((at, k) => at - before[k]), this.yaw);
      this.#step(x, z);
    }
    this.#faces = false;
    let forward = +this.pressed, right = 0, turns = 0;
    for (const source of sources) {
      const [x, y] = stickOf(source);
      forward -= beyond(y);
      if (source.handedness === "right") turns = Math.abs(x) > Math.abs(turns) ? x : turns;
      else right += beyond(x);
    }
    if (this.#ready && Math.abs(turns) > PUSHED) {
      this.yaw -= Math.sign(turns) * TURN;
      this.#ready = false;
    }
    this.#ready ||= Math.abs(turns) < LET_GO;
    pose.yaw = this.yaw + yaw;
    pose.pitch = 0;
    return { forward: Math.min(1, forward), right, turn: 0, look: 0, run: false };
  }

  /** Takes a step of the room in the building; what walls stop of it moves the room along.
   * @param {number} dx @param {number} dz */
  #step(dx, dz) {
    const { solids, locate, pose: { eye } } = this.walker;
    const [x, z] = stepOf(solids, this.head, eye[1], dx, dz), cell = locate([x, eye[1], z]);
    // As with sticks, not out of the building, nor where the walls are still missing.
    if (cell >= 0 && solids.has(cell)) Object.assign(eye, { 0: x, 2: z });
  }

  /** The head in the building. @returns {number[]} */
  get head() {
    const { pose: { eye }, height } = this.walker;
    return [eye[0], eye[1] + this.#place[1] - (this.floored ? height : 0), eye[2]];
  }

  /** The axes of the head in the building; those of eyes may be canted. @returns {number[][]} */
  get axes() {
    return this.#axes.map((axis) => turned(axis, this.yaw));
  }

  /** An eye in the building. @param {{transform: {matrix: ArrayLike<number>}, projectionMatrix: ArrayLike<number>}} view
   * @param {number} lines @returns {Eye} */
  eye({ transform: { matrix: m }, projectionMatrix: projection }, lines) {
    const off = turned(this.#place.map((at, k) => m[12 + k] - at), this.yaw);
    return {
      place: this.head.map((x, k) => x + off[k]),
      axes: axesOf(m).map((axis) => turned(axis, this.yaw)),
      projection,
      lines,
    };
  }
}
