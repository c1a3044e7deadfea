// In which cell an eye is: the one of whose leaves it is behind all planes.

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

/** The leaves of the cells whose record is there. */
export class Locator {
  #boxes;
  /** @type {({leaves: number[][][], adjacent: number[]} | undefined)[]} by cell */
  #cells;

  /** @param {{C: number, low: Vector, high: Vector}} catalogue */
  constructor(catalogue) {
    this.#boxes = catalogue;
    this.#cells = new Array(catalogue.C).fill(undefined);
  }

  /** @param {number} cell @param {CellRecord} record */
  learn(cell, { leaves, adjacent }) {
    this.#cells[cell] = { leaves: leaves.map(planesOf), adjacent };
  }

  /**
   * The cell that the eye is in, of those whose record is there: the one before if it still is, else
   * one of those next to it, else any; −1 for none.
   * @param {Vector} eye
   * @param {number} from the cell before, or −1
   */
  locate(eye, from) {
    if (this.#holds(from, eye)) return from;
    return this.#near(eye, from).find((cell) => this.#holds(cell, eye)) ?? -1;
  }

  /**
   * Cells that the eye may be in and whose record is not there, those next to the one before first.
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
    const { C, low, high } = this.#boxes, adjacent = this.#cells[from]?.adjacent ?? [];
    /** @type {number[]} */
    const near = [];
    /** @type {number[]} */
    const far = [];
    for (let c = 0; c < C; c++) {
      let inside = true;
      for (let i = 0; i < 3; i++) {
        inside &&= low[3 * c + i] - SLACK <= eye[i] && eye[i] <= high[3 * c + i] + SLACK;
      }
      if (inside) (adjacent.includes(c) ? near : far).push(c);
    }
    return [...near, ...far];
  }

  /** @param {number} cell @param {Vector} eye */
  #holds(cell, eye) {
    return !!this.#cells[cell]?.leaves.some(
      (planes) => planes.every((plane) => dot(plane, eye) + plane[3] <= SLACK),
    );
  }
}
