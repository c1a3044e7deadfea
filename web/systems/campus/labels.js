// Points of interest: names over the objects in view, larger when near, and a menu of all of them.

import { find, make } from "../../page/ui/elements.js";
import { iconOf } from "./icons.js";

/** Names in view at a time, and the farthest, m. */
const MOST = 12, FARTHEST = 200;
/** Pixels of a name: the least, the largest, and the product of pixels and metres between them. */
const SMALL = 11, LARGE = 24, NEAR = 400;

/** Pixels that a pointer may move while it presses a name. */
const SLIP = 5;

/** @typedef {import("./index.js").CampusObject} CampusObject */

/** A name for visitors: "building_02_hall" is "Building 02 hall". @param {CampusObject} object */
export const nameOf = ({ label }) => {
  const words = label.replace(/[\s_]+/g, " ").trim();
  return words.charAt(0).toUpperCase() + words.slice(1);
};

/** A group's name is what its labels have in common before a number. @param {string} label */
const groupOf = (label) => label.replace(/[\s_.-]*\d+$/, "");

export class Labels {
  /** @type {{object: CampusObject, button: HTMLButtonElement}[]} */
  #labels;

  /** @param {Document} root @param {CampusObject[]} objects @param {(object: CampusObject) => void} visit */
  constructor(root, objects, visit) {
    const layer = find(root, "#labels"), canvas = find(root, "canvas");
    this.#labels = objects.map((object) => {
      const button = make("button", { hidden: true, tabIndex: -1 }, ...iconOf(object.icon), nameOf(object));
      // Clicks of a pointer are the canvas's, see below.
      button.onclick = (/** @type {MouseEvent} */ { detail }) => detail || visit(object);
      layer.append(button);
      return { object, button };
    });
    /** Where the pointer pressed a name. @type {{object: CampusObject, id: number, x: number, y: number} | null} */
    let pressed = null;
    // A press of a name may be the begin of a drag, which the canvas captures.
    layer.addEventListener("pointerdown", (/** @type {PointerEvent} */ event) => {
      const one = this.#labels.find(({ button }) => button.contains(/** @type {Node} */ (event.target)));
      if (!one || event.button !== 0) return;
      event.preventDefault();
      pressed = { object: one.object, id: event.pointerId, x: event.clientX, y: event.clientY };
      canvas.dispatchEvent(new PointerEvent(event.type, event));
    });
    canvas.addEventListener("pointermove", (/** @type {PointerEvent} */ { pointerId, clientX, clientY }) => {
      if (pressed?.id === pointerId && Math.hypot(clientX - pressed.x, clientY - pressed.y) > SLIP) pressed = null;
    });
    canvas.addEventListener("pointerup", (/** @type {PointerEvent} */ { pointerId }) => {
      if (pressed?.id === pointerId) visit(pressed.object);
      pressed = null;
    });
    canvas.addEventListener("pointercancel", () => (pressed = null));
    this.#menu(find(root, "#places"), objects, visit);
  }

  /** A list of all objects by their ranks, then of those without by their names. Of these,
   * those that differ by a number are one entry that opens.
   * @param {HTMLElement} list @param {CampusObject[]} objects @param {(object: CampusObject) => void} visit */
  #menu(list, objects, visit) {
    /** @type {Map<string, CampusObject[]>} */
    const groups = new Map();
    const rankOf = (/** @type {CampusObject} */ { rank }) => rank ?? Number.MAX_SAFE_INTEGER;
    const sorted = [...objects].sort((a, b) => rankOf(a) - rankOf(b) || nameOf(a).localeCompare(nameOf(b), undefined, { numeric: true }));
    for (const object of sorted) {
      const group = object.rank === undefined ? groupOf(nameOf(object)) : ` ${object.name}`;
      groups.set(group, [...(groups.get(group) ?? []), object]);
    }
    const entry = (/** @type {CampusObject} */ object) =>
      make("li", {}, make("button", { onclick: () => visit(object) }, ...iconOf(object.icon), nameOf(object)));
    for (const [group, some] of groups) {
      if (some.length === 1) list.append(entry(some[0]));
      else list.append(make("li", {}, make("details", {}, make("summary", {}, `${group} (${some.length})`), make("ul", {}, ...some.map(entry)))));
    }
  }

  /**
   * Places the names of a frame.
   * @param {import("../../page/gl/camera.js").Camera} camera
   * @param {number} width of the canvas on the screen @param {number} height
   */
  place({ eye, turn, lens }, width, height) {
    const seen = this.#labels.map(({ object: { box }, button }) => {
      const place = [0, 1, 2].map((k) => (k === 1 ? box[4] : (box[k] + box[k + 3]) / 2) - eye[k]);
      const [x, y, z] = [0, 1, 2].map((row) => place.reduce((sum, value, k) => sum + turn[3 * k + row] * value, 0));
      const far = Math.hypot(...place);
      const across = (x * lens[0]) / -z, up = (y * lens[1]) / -z;
      return { button, far, across, up, visible: z < 0 && far < FARTHEST && Math.abs(across) < 1 && Math.abs(up) < 1 };
    });
    const shown = new Set(seen.filter(({ visible }) => visible).sort((a, b) => a.far - b.far).slice(0, MOST));
    for (const one of seen) {
      const { button, far, across, up } = one;
      button.hidden = !shown.has(one);
      if (button.hidden) continue;
      const size = Math.max(SMALL, Math.min(LARGE, NEAR / far));
      button.style.cssText = `left:${((across + 1) / 2) * width}px;top:${((1 - up) / 2) * height}px;font-size:${size}px`;
    }
  }
}
