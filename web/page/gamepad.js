// The script of gamepads: sticks walk and turn, buttons lead to places, into panels and through their controls
// (docs/formats/devices.md). Gamepads are read in each frame while one is connected.

import { aside, focus, focused, move, reachable, use } from "./pad/focus.js";
import { OWN } from "./ui/controls.js";

/** @typedef {import("./walk/walker.js").Wishes} Wishes */
/** @typedef {Pick<Gamepad, "axes" | "buttons" | "mapping">} Pad */

/** The push of a stick below which it rests: worn ones do not return to 0. */
const REST = 0.15;
/** Seconds until a button of the D-pad repeats, and then between its presses; longest time of a frame that counts. */
const FIRST = 0.5, AGAIN = 0.12, FRAME = 0.1;
/** Buttons of the standard layout. */
const USE = 0, BACK = 1, BEFORE = 4, NEXT = 5, RUN = 7, STICKS = [10, 11];
/** The panels of buttons. @type {Record<number, string>} */
const PANELS = { 3: "tour", 8: "map", 9: "places" };
/** Of the D-pad. @type {Record<number, () => void>} */
const D_PAD = { 12: () => move(-1), 13: () => move(1), 14: () => aside(-1), 15: () => aside(1) };

/** A stick beyond its rest, at most of length 1. @param {number} x @param {number} y */
export function pushed(x = 0, y = 0) {
  const length = Math.hypot(x, y), share = Math.min(1, Math.max(0, (length - REST) / (1 - REST)));
  return length ? [(x * share) / length, (y * share) / length] : [0, 0];
}

/** Both sticks: right, back, turn to the right, down. @param {Pad} pad */
const sticks = ({ axes }) => [...pushed(axes[0], axes[1]), ...pushed(axes[2], axes[3])];

/**
 * The wishes of keys and pointers together with those of a gamepad.
 * @param {Wishes} wishes @param {Pad} pad
 * @returns {Wishes}
 */
export function joinedWishes(wishes, pad) {
  const [right, back, turn, down] = sticks(pad);
  const limited = (/** @type {number} */ wish) => Math.max(-1, Math.min(1, wish));
  return {
    ...wishes,
    forward: limited(wishes.forward - back),
    right: limited(wishes.right + right),
    turn: limited(wishes.turn - turn),
    look: limited(wishes.look - down),
    run: wishes.run || (pad.mapping === "standard" && Boolean(pad.buttons[RUN]?.pressed)),
  };
}

const canvas = () => /** @type {HTMLElement} */ (document.querySelector("#view"));

/** Buttons, of all gamepads together, and the panel that they are to enter. */
class Buttons {
  /** Seconds until a button that is held repeats. @type {Map<number, number>} */
  #held = new Map();
  #place = 0;
  /** @type {HTMLElement | null} */
  #entering = null;

  /** @param {import("./app.js").App} [app] */
  constructor(app) {
    this.app = app;
  }

  /** Buttons that do nothing until they are released. @param {Set<number>} pressed */
  hold(pressed) {
    for (const button of pressed) this.#held.set(button, Infinity);
  }

  /** @param {Set<number>} pressed @param {number} time s */
  take(pressed, time) {
    for (const button of this.#held.keys()) if (!pressed.has(button)) this.#held.delete(button);
    for (const button of pressed) {
      const left = (this.#held.get(button) ?? 0) - time, first = !this.#held.has(button);
      if (first || (left <= 0 && button in D_PAD)) {
        this.#held.set(button, first ? FIRST : AGAIN);
        this.#press(button);
      } else this.#held.set(button, left);
    }
    this.#enter();
  }

  /** @param {number} button */
  #press(button) {
    const view = canvas();
    if (button in D_PAD) D_PAD[button]();
    else if (button === USE) use();
    // Behind the message of an error nothing can be used.
    else if (view.inert) return;
    else if (button === BEFORE || button === NEXT) this.#go(button === NEXT ? 1 : -1);
    else if (button === BACK) {
      document.body.dispatchEvent(new KeyboardEvent("keydown", { code: "Escape", bubbles: true }));
      view.focus();
    } else if (STICKS.includes(button)) view.focus();
    else if (button in PANELS) this.#open(PANELS[button]);
  }

  /** @param {number} by */
  #go(by) {
    const { app } = this, count = app?.index.viewpoints.length;
    if (!app || !count) return;
    this.#place = (this.#place + by + count) % count;
    app.goTo(this.#place);
  }

  /** Opens a panel to enter it; from inside, or without anything to use in it, closes it. @param {string} name */
  #open(name) {
    const button = /** @type {HTMLElement | null} */ (document.querySelector(`nav [aria-controls=${name}]`));
    const panel = /** @type {HTMLElement | null} */ (document.querySelector(`#${name}`));
    if (!button || !panel) return;
    const inside = panel.contains(focused());
    if (panel.hidden || inside || !reachable(panel).length) button.click();
    if (inside) canvas().focus();
    this.#entering = panel;
  }

  /** Enters a panel once its script has filled it. */
  #enter() {
    const panel = this.#entering;
    if (panel?.hidden) this.#entering = null;
    if (!panel?.childElementCount || panel.hidden) return;
    this.#entering = null;
    const [first] = reachable(panel), current = panel.querySelector("[aria-current]");
    if (first) focus(/** @type {HTMLElement | null} */ (current) ?? first);
  }
}

let attached = false;

/** @param {import("./app.js").App} [app] */
export function attachGamepad(app) {
  if (attached) return;
  attached = true;
  const buttons = new Buttons(app);
  let reads = false, wakes = false, before = 0;
  const connected = () => (reads ? [...navigator.getGamepads()].filter((pad) => pad?.connected) : []);
  if (app) {
    const { frame } = app;
    // A frame ends with an error, gamepads answer its message: buttons have frames of their own.
    app.frame = (time, wishes) => {
      // As with keys, one does not walk from a panel.
      for (const pad of focused().closest(OWN) ? [] : connected()) {
        if (pad) wishes = joinedWishes(wishes, pad);
      }
      frame.call(app, time, wishes);
    };
  }
  const read = (/** @type {number} */ now) => {
    const pads = connected(), pressed = new Set();
    reads = pads.length > 0;
    if (reads) requestAnimationFrame(read);
    for (const pad of pads) {
      if (pad?.mapping === "standard") pad.buttons.forEach((one, k) => one.pressed && pressed.add(k));
    }
    // A browser shows a gamepad once a button is pressed: that press is for nothing else.
    if (wakes) buttons.hold(pressed);
    wakes = false;
    buttons.take(pressed, Math.min(FRAME, (now - before) / 1000));
    before = now;
    // A kiosk waits for a visitor's rest.
    const moves = pads.some((pad) => pad && sticks(pad).some(Boolean));
    if (moves || pressed.size) dispatchEvent(new Event("gamepadused"));
  };
  const begin = () => {
    if (!reads) requestAnimationFrame(read);
    reads = wakes = true;
  };
  addEventListener("gamepadconnected", begin);
  begin();
}
