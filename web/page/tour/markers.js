// Markers of labels, over the picture: buttons where the objects are, of those only that nothing hides.
//
// With each item buffer, a point for each near marker is drawn into its depth, in an occlusion query: the
// result is there some frames later, and nothing waits.

import { aim, programOf } from "../gl/program.js";
import { make } from "../ui/elements.js";

/** Farthest markers, m, and the most that are shown. */
const FAR = 15, MOST = 24;
/** The tested point is nearer to the eye than the marker, by a share of the distance and m: pixels are large. */
const NEARER = 0.03, BEFORE = 0.15;
/** Pixels beyond the edge of the picture where a marker still has its middle. */
const EDGE = 8;

const VERTEX = `#version 300 es
precision highp float;
uniform vec3 eye;
uniform mat3 turn;
uniform vec4 lens;
uniform vec3 point;
void main() {
  vec3 seen = turn * (point - eye);
  gl_Position = vec4(seen.xy * lens.xy, seen.z * lens.z + lens.w, -seen.z);
  gl_PointSize = 1.0;
}`;
const FRAGMENT = `#version 300 es
precision mediump float;
out vec4 shown;
void main() { shown = vec4(0.0); }`;

/** @typedef {import("./document.js").Label} Label */
/** @typedef {import("../walkthrough.js").Walkthrough} Walkthrough */

export class Markers {
  /** Whether something was seen of each label's marker. @type {boolean[]} */
  #seen = [];
  /** Queries on their way. @type {{label: number, query: WebGLQuery}[]} */
  #queries = [];
  /** @type {import("../gl/program.js").Program | null} */
  #program = null;
  /** @type {WebGLVertexArrayObject | null} */
  #array = null;
  /** Buttons by label. @type {Map<number, HTMLButtonElement>} */
  #buttons = new Map();
  /** The label that is open, or -1. */
  current = -1;

  /**
   * @param {Walkthrough} walk
   * @param {Label[]} labels
   * @param {object} use
   * @param {(label: number) => string} use.nameOf a label
   * @param {(label: number) => void} use.open called when a marker is used
   */
  constructor(walk, labels, { nameOf, open }) {
    this.walk = walk;
    this.labels = labels;
    this.nameOf = nameOf;
    this.open = open;
    this.root = make("div", { id: "markers" });
    walk.viewport.canvas.after(this.root);
    walk.needs.probe = (camera) => this.#probe(camera);
    walk.picture.turn();
    walk.viewport.canvas.addEventListener("webglcontextlost", () => {
      this.#program = null;
      this.#queries = [];
    });
  }

  /** Labels whose markers are shown, the nearest first. */
  get shown() {
    return [...this.#buttons.keys()];
  }

  /** Labels near the eye in visible cells, the nearest first. @param {ArrayLike<number>} eye */
  #near(eye) {
    const visible = new Set(this.walk.visible);
    return this.labels
      .map(({ marker, cell }, label) => {
        const away = Math.hypot(...marker.map((x, k) => x - eye[k]));
        return { label, away: cell < 0 || visible.has(cell) ? away : Infinity };
      })
      .filter(({ away }) => away < FAR)
      .sort((a, b) => a.away - b.away)
      .slice(0, MOST);
  }

  /** Reads the results of the last queries, and begins new ones. @param {import("../gl/camera.js").Camera} camera */
  #probe(camera) {
    const { gl } = this.walk;
    this.#poll();
    if (this.#queries.length) return;
    this.#program ??= programOf(gl, "markers", [VERTEX, FRAGMENT]);
    this.#array ??= gl.createVertexArray();
    aim(gl, this.#program, camera);
    gl.bindVertexArray(this.#array);
    gl.colorMask(false, false, false, false);
    gl.depthMask(false);
    for (const { label, away } of this.#near(camera.eye)) {
      const query = gl.createQuery();
      if (!query) break;
      const share = Math.max(0, 1 - NEARER - BEFORE / Math.max(away, BEFORE));
      const point = this.labels[label].marker.map((x, k) => camera.eye[k] + (x - camera.eye[k]) * share);
      gl.uniform3fv(this.#program.at.point, point);
      gl.beginQuery(gl.ANY_SAMPLES_PASSED_CONSERVATIVE, query);
      gl.drawArrays(gl.POINTS, 0, 1);
      gl.endQuery(gl.ANY_SAMPLES_PASSED_CONSERVATIVE);
      this.#queries.push({ label, query });
    }
    gl.colorMask(true, true, true, true);
    gl.depthMask(true);
  }

  #poll() {
    const { gl } = this.walk, queries = this.#queries;
    const last = queries.at(-1);
    if (!last || !gl.getQueryParameter(last.query, gl.QUERY_RESULT_AVAILABLE)) return;
    this.#seen = [];
    for (const { label, query } of queries) {
      this.#seen[label] = Boolean(gl.getQueryParameter(query, gl.QUERY_RESULT));
      gl.deleteQuery(query);
    }
    this.#queries = [];
  }

  /** Moves the buttons to the markers that are seen. @param {import("../gl/camera.js").Pose} pose */
  place(pose) {
    const { walk } = this, { clientWidth: width, clientHeight: height } = walk.viewport.canvas;
    this.#poll();
    const { eye, turn, lens } = walk.viewport.camera(pose);
    /** @type {Map<number, HTMLButtonElement>} */
    const buttons = new Map();
    for (const { label } of this.#near(eye)) {
      if (!this.#seen[label]) continue;
      const [x, y, z] = this.labels[label].marker.map((value, k) => value - eye[k]);
      const view = [0, 1, 2].map((k) => turn[k] * x + turn[k + 3] * y + turn[k + 6] * z);
      if (view[2] >= 0) continue;
      const across = (0.5 - (view[0] * lens[0]) / view[2] / 2) * width;
      const down = (0.5 + (view[1] * lens[1]) / view[2] / 2) * height;
      if (across < -EDGE || down < -EDGE || across > width + EDGE || down > height + EDGE) continue;
      const button = this.#buttons.get(label) ?? this.#button(label);
      button.style.transform = `translate(${across.toFixed(1)}px,${down.toFixed(1)}px)`;
      button.toggleAttribute("aria-current", label === this.current);
      buttons.set(label, button);
    }
    for (const [label, button] of this.#buttons) {
      if (buttons.has(label)) continue;
      // A button that has the focus stays where it was until it loses it.
      if (button === document.activeElement) buttons.set(label, button);
      else button.remove();
    }
    this.#buttons = buttons;
  }

  /** @param {number} label */
  #button(label) {
    const name = this.nameOf(label);
    const button = make("button", { title: name, ariaLabel: name });
    button.onclick = () => this.open(label);
    this.root.append(button);
    return button;
  }

  /** Names the buttons again, in another language. */
  rename() {
    for (const [label, button] of this.#buttons) {
      button.title = button.ariaLabel = this.nameOf(label);
    }
  }

  /**
   * The ray through a pixel of the picture.
   * @param {import("../gl/camera.js").Pose} pose @param {number} across @param {number} down
   */
  rayAt(pose, across, down) {
    const { walk } = this, { clientWidth: width, clientHeight: height } = walk.viewport.canvas;
    const { eye, turn, lens } = walk.viewport.camera(pose);
    const view = [(2 * across / width - 1) / lens[0], (1 - 2 * down / height) / lens[1], -1];
    // The transpose turns back.
    const ray = [0, 1, 2].map((k) => turn[3 * k] * view[0] + turn[3 * k + 1] * view[1] + turn[3 * k + 2] * view[2]);
    return { eye, ray };
  }

  /** Shows other labels. @param {Label[]} labels */
  renew(labels) {
    const { gl } = this.walk, before = new Map(this.labels.map((label, k) => [keyOf(label), this.#seen[k]]));
    this.labels = labels;
    this.#seen = labels.map((label) => before.get(keyOf(label)) ?? false);
    for (const { query } of this.#queries) gl.deleteQuery(query);
    this.#queries = [];
    for (const button of this.#buttons.values()) button.remove();
    this.#buttons.clear();
    this.walk.picture.turn();
  }

  /**
   * The label whose object a pixel of the picture shows, or -1: the nearest box on its ray, if the marker of
   * the label is seen.
   * @param {import("../gl/camera.js").Pose} pose
   * @param {number} across pixels from the left
   * @param {number} down pixels from the top
   */
  at(pose, across, down) {
    const { eye, ray } = this.rayAt(pose, across, down);
    let nearest = -1, first = Infinity;
    for (const { label } of this.#near(eye)) {
      if (!this.#seen[label]) continue;
      const away = entry(eye, ray, this.labels[label].box);
      if (away < first) [nearest, first] = [label, away];
    }
    return nearest;
  }
}

/** A label at its place. @param {Label} label */
const keyOf = ({ id, marker }) => `${id} ${marker}`;

/**
 * Where a ray enters a box, in units of the ray; Infinity if it misses it.
 * @param {ArrayLike<number>} eye @param {number[]} ray @param {number[]} box
 */
function entry(eye, ray, box) {
  let near = 0, far = Infinity;
  for (let k = 0; k < 3; k++) {
    const a = (box[k] - eye[k]) / ray[k], b = (box[k + 3] - eye[k]) / ray[k];
    // NaN: parallel, and on a face.
    near = Math.max(near, Math.min(a, b) || near);
    far = Math.min(far, Number.isNaN(Math.max(a, b)) ? far : Math.max(a, b));
  }
  return near <= far ? near : Infinity;
}
