// A pose as the fragment of the URL: #x,y,z,yaw and optionally pitch, metres and degrees.

import { loadLater } from "../load-later.js";
import { find } from "./elements.js";
import { showNotice } from "./errors.js";
import { page } from "../words/english.js";

/** @typedef {import("../walk/walker.js").Pose} Pose */

const DEGREES = 180 / Math.PI;
/** How often the address may follow the visitor, ms: browsers refuse much faster updates. */
const OFTEN = 500;

/** @param {string} fragment @returns {Pose | null} */
export function poseOf(fragment) {
  const numbers = fragment.replace(/^#/, "").split(",").map((text) => (text ? Number(text) : NaN));
  if (numbers.length < 4 || numbers.length > 5 || !numbers.every(Number.isFinite)) return null;
  const [x, y, z, yaw, pitch = 0] = numbers;
  const tilted = Math.max(-89, Math.min(89, pitch));
  return { eye: [x, y, z], yaw: yaw / DEGREES, pitch: tilted / DEGREES };
}

/** @param {Pose} pose */
export function fragmentOf({ eye, yaw, pitch }) {
  const turned = (((yaw * DEGREES) % 360) + 360) % 360, tilted = pitch * DEGREES;
  const numbers = [...eye.map((v) => v.toFixed(2)), turned.toFixed(1)];
  if (Math.abs(tilted) >= 0.05) numbers.push(tilted.toFixed(1));
  return `#${numbers.map(Number).join()}`;
}

/** @param {Document} root @param {import("./all.js").App} app */
export function attachAddress(root, app) {
  const { walker } = app;
  let last = "";
  const here = () => {
    last = fragmentOf(walker.pose);
    if (last !== location.hash) history.replaceState(null, "", last);
    return location.href;
  };
  setInterval(() => {
    if (walker.still && fragmentOf(walker.pose) !== last) here();
  }, OFTEN);
  addEventListener("hashchange", () => {
    const pose = poseOf(location.hash);
    if (pose && location.hash !== last) app.follow(pose);
  });
  find(root, "#link").onclick = async () => {
    const link = here();
    try {
      await navigator.clipboard.writeText(link);
      showNotice(root, page.copied);
    } catch {
      loadLater().then(({ showLink }) => showLink(root, link), () => showNotice(root, page.unloaded));
    }
  };
}
