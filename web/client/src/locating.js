// The cell that a point is in: the point is behind all planes of one of its leaves.

import { dot, facing } from "./vectors.js";

/** @typedef {ArrayLike<number>} Vector */
/**
 * @typedef {object} CellRecord
 * @property {{points: number[][], faces: number[][]}[]} leaves
 * @property {number[]} adjacent
 * @property {{neighbour: number, polygon: number[][], passage?: boolean}[]} [portals]
 */

// Metres that an eye may be in front of a plane: leaves that touch then overlap
// (docs/formats/hints.md).
const SLACK = 1e-3;
// Metres from a passage, a portal that a door leaf covers, within which an eye belongs to the cells on
// both sides: it may be inside the leaf, or so near that the picture has no leaf.
const REACH = 0.5;

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

/**
 * Whether a point is at most `REACH` from the box around a polygon.
 * @param {Vector} eye
 * @param {number[][]} polygon
 */
function isNear(eye, polygon) {
  return [0, 1, 2].every((k) => {
    const along = polygon.map((point) => point[k]);
    return Math.min(...along) - REACH <= eye[k] && eye[k] <= Math.max(...along) + REACH;
  });
}

/** Locates points among the cells whose records it has learned. */
export class Locator {
  #boxes;
  /** @type {({leaves: number[][][], adjacent: number[], passages: NonNullable<CellRecord["portals"]>}
   *   | undefined)[]} by cell */
  #cells;

  /** @param {Vector[]} boxes of each cell: x, y, z of the low corner, then of the high one, metres */
  constructor(boxes) {
    this.#boxes = boxes;
    this.#cells = new Array(boxes.length).fill(undefined);
  }

  /** @param {number} cell @param {CellRecord} record */
  learn(cell, { leaves, adjacent, portals = [] }) {
    const passages = portals.filter(({ passage }) => passage);
    this.#cells[cell] = { leaves: leaves.map(planesOf), adjacent, passages };
  }

  /**
   * The cells that an eye in a cell belongs to: this one, and those beyond near passages.
   * @param {Vector} eye
   * @param {number} cell
   */
  around(eye, cell) {
    const cells = [cell];
    for (const one of cells) {
      for (const { neighbour, polygon } of this.#cells[one]?.passages ?? []) {
        if (!cells.includes(neighbour) && isNear(eye, polygon)) cells.push(neighbour);
      }
    }
    return cells;
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
