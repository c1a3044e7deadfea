// Reads the visitor's input: keys, dragging with a mouse, one or two fingers.

import { find } from "./elements.js";

/** @typedef {import("../walk/walker.js").Wishes} Wishes */
/** @typedef {{id: number, x: number, y: number, u: number, v: number, touch: boolean}} Pointer
 *   where it went down, and where it is, pixels */

/** The effect of each key, as [wish, sign]. @type {Record<string, [string, number]>} */
const KEYS = {
  KeyW: ["forward", 1], ArrowUp: ["forward", 1], KeyS: ["forward", -1], ArrowDown: ["forward", -1],
  KeyA: ["turn", 1], ArrowLeft: ["turn", 1], KeyD: ["turn", -1], ArrowRight: ["turn", -1],
  KeyQ: ["right", -1], KeyE: ["right", 1], PageUp: ["look", 1], PageDown: ["look", -1],
};
/** Elements in which keys have a meaning of their own. */
export const OWN = "input, select, textarea, ol, #places, #panels section";
/** Pixels of a thumb's movement for a full wish, and below which there is none. */
const REACH = 56, REST = 8;
/** Vertical field of view, radians: a dragged point stays under the pointer. */
const VIEW = Math.PI / 3;

/** @param {number} pixels */
const pushed = (pixels) => {
  const far = Math.max(0, Math.abs(pixels) - REST) / (REACH - REST);
  return Math.sign(pixels) * Math.min(1, far);
};

/**
 * @param {ParentNode} root @param {{canvas: HTMLElement}} app
 * @returns {{wishes: () => Wishes}} called in each frame
 */
export function attachControls(root, { canvas }) {
  /** @type {Set<string>} */
  const keys = new Set();
  /** @type {Pointer[]} */
  let pointers = [];
  let yaw = 0, pitch = 0, run = false;
  const stick = find(root, "#stick");
  const release = () => {
    keys.clear();
    pointers = [];
    run = false;
    show();
  };
  const thumb = () => (pointers.length === 1 && pointers[0].touch ? pointers[0] : null);
  const show = () => {
    const one = thumb();
    stick.hidden = !one;
    if (!one) return;
    const x = one.u - one.x, y = one.v - one.y, far = Math.max(1, Math.hypot(x, y) / REACH);
    stick.style = `left:${one.x}px;top:${one.y}px;--x:${x / far}px;--y:${y / far}px`;
  };

  addEventListener("keydown", (event) => {
    run = event.shiftKey;
    const { target, code } = event;
    // The release of a key that is held together with these is not reported.
    if (event.ctrlKey || event.altKey || event.metaKey) return keys.clear();
    if (!(code in KEYS)) return;
    if (target instanceof Element && target.closest(OWN)) return;
    keys.add(code);
    event.preventDefault();
  });
  addEventListener("keyup", ({ code, shiftKey }) => {
    run = shiftKey;
    keys.delete(code);
  });
  addEventListener("blur", release);
  document.addEventListener("visibilitychange", release);

  canvas.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    const { pointerId: id, clientX: x, clientY: y } = event;
    canvas.setPointerCapture(id);
    canvas.focus({ preventScroll: true });
    pointers.push({ id, x, y, u: x, v: y, touch: event.pointerType === "touch" });
    show();
  });
  canvas.addEventListener("pointermove", ({ pointerId, clientX, clientY }) => {
    const one = pointers.find(({ id }) => id === pointerId);
    if (!one) return;
    if (!thumb()) {
      const share = VIEW / canvas.clientHeight / pointers.length;
      yaw += (clientX - one.u) * share;
      pitch += (clientY - one.v) * share;
    }
    one.u = clientX;
    one.v = clientY;
    show();
  });
  for (const kind of /** @type {const} */ (["pointerup", "pointercancel"])) {
    canvas.addEventListener(kind, ({ pointerId }) => {
      pointers = pointers.filter(({ id }) => id !== pointerId);
      // Lifting one of two fingers does not start a walk with the other.
      for (const one of pointers) [one.x, one.y] = [one.u, one.v];
      show();
    });
  }
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());

  const wishes = () => {
    const wishes = { forward: 0, right: 0, turn: 0, look: 0, run, yaw, pitch };
    yaw = pitch = 0;
    for (const code of keys) {
      let [wish, sign] = KEYS[code];
      if (run && code.startsWith("Arrow") && wish === "turn") [wish, sign] = ["right", -sign];
      wishes[/** @type {"forward" | "right" | "turn" | "look"} */ (wish)] += sign;
    }
    const one = thumb();
    if (one) {
      wishes.forward += pushed(one.y - one.v);
      wishes.turn += pushed(one.x - one.u);
    }
    for (const wish of /** @type {const} */ (["forward", "right", "turn", "look"])) {
      wishes[wish] = Math.max(-1, Math.min(1, wishes[wish]));
    }
    return wishes;
  };
  return { wishes };
}
