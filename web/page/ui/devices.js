// Gamepads and headsets: their scripts are loaded when one is there.

import { loadGamepad, loadXr } from "../load-devices.js";
import { devices } from "../words/english.js";
import { fill } from "../words/language.js";
import { find, make } from "./elements.js";
import { showNotice } from "./errors.js";

/** @typedef {import("../app.js").App} Walk */

/** Lets a gamepad walk, as soon as a button of it is pressed; without a walk it answers the message of an error.
 * @param {Walk} [app] */
export function attachPads(app) {
  const attach = () => loadGamepad().then((script) => script.attachGamepad(app), () => {});
  addEventListener("gamepadconnected", attach, { once: true });
  try {
    if (navigator.getGamepads().some(Boolean)) attach();
  } catch {
    // A page that shows the walk in a frame may forbid gamepads.
  }
}

/** Adds a button where a headset is. @param {HTMLElement} root @param {Walk} app */
export async function attachVr(root, app) {
  const { xr } = /** @type {any} */ (navigator);
  if (!(await xr?.isSessionSupported("immersive-vr").catch(() => false))) return;
  // Browsers forget a click while a slow link brings the script.
  loadXr().catch(() => {});
  const button = make("button", { className: "vr" }, devices.enterVr);
  button.onclick = async () => {
    button.disabled = true;
    try {
      await (await loadXr()).enterVr(app);
    } catch (fault) {
      const { message } = /** @type {Error} */ (fault);
      showNotice(document, fill(devices.noVr, { reason: message }));
    }
    button.disabled = false;
  };
  root.append(button);
}

/** What the address asks for. @param {Walk} app @param {string[]} wanted */
export function attachDevices(app, wanted) {
  if (wanted.includes("gamepad")) attachPads(app);
  if (wanted.includes("xr")) attachVr(find(document, "nav"), app);
}
