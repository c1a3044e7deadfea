// The cell that a point is in: the point is behind all planes of one of its leaves.

import { dot, facing } from "./vectors.js";

/** @typedef {ArrayLike<number>} Vector */
/** @typedef {{leaves: {points: number[][], faces: number[][]}[], adjacent: number[]}} CellRecord */

// Metres that an eye may be in front of a plane: leaves that touch then overlap
// (docs/formats/hints.md).
const SLACK = 1e-3;

/**
 * The planes of the faces of a leaf: unit normal, outwards, and offset of each.
 * @param {{points: number[][], faces: number[][]}} leaf
 */
function planesOf({ points, faces }) {
  return faces.map((loop) => {
    const corners = loop.map((n) => points[n]), turned = facing(corners);
    const length = Math.max(Math.hypot(...turned), Number.MIN_VALUE);
    const normal = turned.map((x) => x / length);
    const far = corners.reduce((sum, corner) => sum + dot(corner, normal), 0) / corners.length;
    return [...normal, -far];
  });
}

/** Locates points among the cells whose records it has learned. */
export class Locator {
  #boxes;
  /** @type {({leaves: number[][][], adjacent: number[]} | undefined)[]} by cell */
  #cells;

  /** @param {Vector[]} boxes of each cell: x, y, z of the low corner, then of the high one, metres */
  constructor(boxes) {
    this.#boxes = boxes;
    this.#cells = new Array(boxes.length).fill(undefined);
  }

  /** @param {number} cell @param {CellRecord} record */
  learn(cell, { leaves, adjacent }) {
    this.#cells[cell] = { leaves: leaves.map(planesOf), adjacent };
  }

  /**
   * The cell that the eye is in, among those whose record is known: the one before if possible, else one
   * next to it, else any; −1 for none.
   * @param {Vector} eye
   * @param {number} from the cell before, or −1
   */
  locate(eye, from) {
    if (this.#holds(from, eye)) return from;
    return this.#near(eye, from).find((cell) => this.#holds(cell, eye)) ?? -1;
  }

  /**
   * Cells without a known record whose box holds the eye, those next to the one before first.
   * @param {Vector} eye
   * @param {number} from
   */
  candidates(eye, from) {
    return this.#near(eye, from).filter((cell) => !this.#cells[cell]);
  }

  /**
   * The cells whose box holds the eye, those next to `from` first.
   * @param {Vector} eye
   * @param {number} from
   */
  #near(eye, from) {
    const adjacent = this.#cells[from]?.adjacent ?? [];
    /** @type {number[][]} */
    const [near, far] = [[], []];
    this.#boxes.forEach((box, cell) => {
      for (let i = 0; i < 3; i++) {
        if (eye[i] < box[i] - SLACK || eye[i] > box[i + 3] + SLACK) return;
      }
      (adjacent.includes(cell) ? near : far).push(cell);
    });
    return [...near, ...far];
  }

  /** @param {number} cell @param {Vector} eye */
  #holds(cell, eye) {
    return !!this.#cells[cell]?.leaves.some(
      (planes) => planes.every((plane) => dot(plane, eye) + plane[3] <= SLACK),
    );
  }
}
