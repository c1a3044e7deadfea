// The script of gamepads: the left stick walks, the right one turns, buttons lead to places and open panels
// (docs/formats/devices.md). Gamepads are read in each frame while one is connected.

/** @typedef {import("./walk/walker.js").Wishes} Wishes */

/** The push of a stick below which it rests: worn ones do not return to 0. */
const REST = 0.15;
/** Buttons of the standard layout: shoulders, a trigger to run, and what they click. */
const BEFORE = 4, NEXT = 5, RUN = 7, BACK = 1;
/** @type {Record<number, string>} */
const PANELS = { 8: "#map", 9: "#places" };

/** A stick beyond its rest, at most of length 1. @param {number} x @param {number} y */
export function pushed(x = 0, y = 0) {
  const length = Math.hypot(x, y), share = Math.min(1, Math.max(0, (length - REST) / (1 - REST)));
  return length ? [(x * share) / length, (y * share) / length] : [0, 0];
}

/**
 * The wishes of keys and pointers together with those of a gamepad.
 * @param {Wishes} wishes @param {Pick<Gamepad, "axes" | "buttons" | "mapping">} pad
 * @returns {Wishes}
 */
export function joinedWishes(wishes, { axes, buttons, mapping }) {
  const [right, back] = pushed(axes[0], axes[1]), [turn, down] = pushed(axes[2], axes[3]);
  const limited = (/** @type {number} */ wish) => Math.max(-1, Math.min(1, wish));
  return {
    ...wishes,
    forward: limited(wishes.forward - back),
    right: limited(wishes.right + right),
    turn: limited(wishes.turn - turn),
    look: limited(wishes.look - down),
    run: wishes.run || (mapping === "standard" && Boolean(buttons[RUN]?.pressed)),
  };
}

let attached = false;

/** @param {import("./app.js").App} app */
export function attachGamepad(app) {
  if (attached) return;
  attached = true;
  const { frame } = app, count = app.index.viewpoints.length;
  let place = 0;
  /** Of all gamepads together. @type {Set<number>} */
  let held = new Set();
  /** @param {number} button */
  const press = (button) => {
    if (button === BEFORE || button === NEXT) {
      place = (place + (button === NEXT ? 1 : count - 1)) % count;
      app.goTo(place);
    } else if (button === BACK) {
      document.body.dispatchEvent(new KeyboardEvent("keydown", { code: "Escape", bubbles: true }));
    } else if (button in PANELS) {
      /** @type {HTMLElement | null} */ (document.querySelector(`nav [aria-controls=${PANELS[button].slice(1)}]`))?.click();
    }
  };
  let connected = true;
  const look = () => (connected = navigator.getGamepads().some(Boolean));
  addEventListener("gamepadconnected", look);
  addEventListener("gamepaddisconnected", look);
  app.frame = (time, wishes) => {
    const before = wishes, pressed = new Set();
    for (const pad of connected ? navigator.getGamepads() : []) {
      if (!pad?.connected) continue;
      if (pad.mapping === "standard") pad.buttons.forEach((one, k) => one.pressed && pressed.add(k));
      wishes = joinedWishes(wishes, pad);
    }
    for (const button of pressed) if (!held.has(button)) press(button);
    held = pressed;
    // A kiosk waits for a visitor's rest.
    const moves = /** @type {const} */ (["forward", "right", "turn", "look"]).some((k) => wishes[k] !== before[k]);
    if (moves || pressed.size) dispatchEvent(new Event("gamepadused"));
    frame.call(app, time, wishes);
  };
}
