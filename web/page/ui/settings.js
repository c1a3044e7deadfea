// The settings: data saver, texture memory, patience, policy, freezing and comparing.

import { attachPads, attachVr } from "./devices.js";
import { find, inMemory, make } from "./elements.js";
import { panels } from "../words/english.js";

/** @typedef {import("./all.js").App} App */
/** @typedef {import("../app.js").App} Walk */

const MIB = 2 ** 20, POLICIES = ["best", "paper", "whole"];

/**
 * A slider that is moved by factors of the square root of two.
 * @param {HTMLElement} root the panel: the slider is up to date when it opens
 * @param {string} name @param {number[]} range least and greatest @param {() => number} now
 * @param {(value: number) => string} textOf @param {(value: number) => void} choose
 */
function slider(root, name, [least, greatest], now, textOf, choose) {
  const shown = make("span", { ariaHidden: "true" });
  const at = (/** @type {number} */ value) => Math.round(2 * Math.log2(value / least));
  const input = make("input", { type: "range", min: 0, max: at(greatest) });
  const value = () => least * 2 ** (input.value / 2);
  const show = (/** @type {number} */ value) => (shown.textContent = input.ariaValueText = textOf(value));
  input.oninput = () => show(value());
  input.onchange = () => choose(value());
  root.addEventListener("open", () => {
    input.value = at(now());
    show(now());
  });
  return make("label", {}, name, shown, input);
}

/** @param {HTMLElement} root the panel @param {App} app */
export function attachSettings(root, app) {
  const { policy, dataSaver = false } = app.state();
  const saver = make("input", { type: "checkbox", role: "switch", checked: dataSaver });
  saver.onchange = () => app.setDataSaver(saver.checked);
  const policies = POLICIES.map((one) => make("option", { selected: one === policy }, one));
  const choice = make("select", {}, ...policies);
  const seconds = (/** @type {number} */ value) => `${value.toPrecision(2)} s`;
  const waiting = slider(root, panels.patience, [0.0625, 4], () => app.state().patience ?? 0.5, seconds,
    (s) => app.setPatience(s));
  // Only the paper's policy uses it.
  waiting.hidden = policy !== "paper";
  choice.onchange = async () => {
    await app.setPolicy(choice.value);
    choice.value = app.state().policy;
    waiting.hidden = choice.value !== "paper";
  };

  /** @param {string} name @param {(on: boolean) => void} press */
  const toggle = (name, press) => {
    const button = make("button", { "aria-pressed": "false" }, name);
    button.onclick = () => {
      const on = button.getAttribute("aria-pressed") !== "true";
      button.setAttribute("aria-pressed", String(on));
      press(on);
    };
    return button;
  };
  const freeze = toggle(panels.freeze, (on) => app.freeze(on));
  const halves = make("p", { id: "halves", hidden: true }, make("b", {}, panels.streamed), make("b", {}, panels.full));
  find(document, "#panels").before(halves);
  const compare = toggle(panels.compare, (on) => {
    app.compare(on);
    halves.hidden = !on;
  });
  const row = make("p", { className: "row" }, freeze, compare);
  root.append(
    make("h3", {}, panels.settings),
    make("label", { className: "switch" }, panels.saver, saver),
    slider(root, panels.memory, [4 * MIB, 4096 * MIB], () => app.state().budgetBytes, inMemory,
      (bytes) => app.setBudget(bytes)),
    make("label", {}, panels.policy, choice),
    waiting,
    row,
  );
  const walk = /** @type {Walk} */ (/** @type {unknown} */ (app));
  attachPads(walk);
  attachVr(row, walk);
}
