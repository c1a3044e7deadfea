// The focus of a gamepad: it moves through what the Tab key reaches, scrolls texts on its way, and uses what it is on.

import { showNotice } from "../ui/errors.js";
import { devices } from "../words/english.js";

const REACHED = "a[href], audio, button, input, select, summary, textarea, video, [tabindex]";
/** Of these, what holds others; a step to a side does not lead there. */
const HOLDS = "canvas, section";
/** What holds elements that it keeps from the focus; closed details have rectangles in Chromium. */
const CLOSED = "[inert], details:not([open]) > :not(summary)";
/** Share of the height of a panel that a press scrolls. */
const PAGE = 0.6;
/** How much farther a place seems that lies aside of the way. */
const ASIDE = 3;
/** Seconds of a sound that a press skips. */
const SKIP = 5;

/** What the Tab key reaches within an element, in its order. @param {ParentNode} root @returns {HTMLElement[]} */
export const reachable = (root) =>
  /** @type {HTMLElement[]} */ ([...root.querySelectorAll(REACHED)]).filter((one) =>
    one.tabIndex >= 0 && !one.matches(":disabled") && one.getClientRects().length > 0
      && getComputedStyle(one).visibility === "visible" && !one.closest(CLOSED));

/** The element with the focus; without any the picture, from which it begins. @returns {HTMLElement} */
export function focused() {
  const { activeElement: active, body } = document;
  const held = active && active !== body ? active : document.querySelector("#view");
  return /** @type {HTMLElement} */ (held);
}

/** Gives the focus to an element, where it is seen. @param {HTMLElement | undefined} element */
export function focus(element) {
  // Browsers may not show it after a click.
  element?.focus(/** @type {FocusOptions} */ ({ preventScroll: true, focusVisible: true }));
  element?.scrollIntoView({ block: "nearest" });
}

/**
 * Scrolls a panel that has the focus, if more than a step of it comes before the next element.
 * @param {Element} panel @param {HTMLElement | undefined} next @param {number} by -1 upwards, 1 downwards
 */
function scrolls(panel, next, by) {
  const { clientHeight, scrollHeight, scrollTop } = panel, step = PAGE * clientHeight;
  const left = by > 0 ? scrollHeight - clientHeight - scrollTop : scrollTop;
  if (left < 1) return false;
  if (next && panel.contains(next)) {
    const all = panel.getBoundingClientRect(), one = next.getBoundingClientRect();
    if ((by > 0 ? one.top - all.bottom : all.top - one.bottom) <= step) return false;
  }
  panel.scrollBy(0, by * step);
  return true;
}

/** Moves the focus to the next or the previous element. @param {number} by 1 or -1 */
export function move(by) {
  const active = focused(), all = reachable(document);
  const side = by > 0 ? Node.DOCUMENT_POSITION_FOLLOWING : Node.DOCUMENT_POSITION_PRECEDING;
  const beyond = all.filter((one) => active.compareDocumentPosition(one) & side), end = by > 0 ? 0 : -1;
  const next = beyond.at(end), panel = active.closest("#panels section");
  if (!panel || !scrolls(panel, next, by)) focus(next ?? all.at(end));
}

/** @param {HTMLElement} field */
function changed(field) {
  for (const name of ["input", "change"]) field.dispatchEvent(new Event(name, { bubbles: true }));
}

/** Chooses the next option that is not disabled; behind the last the first, if it goes `around`.
 * @param {HTMLSelectElement} field @param {number} by 1 or -1 @param {boolean} [around] */
function choose(field, by, around) {
  const all = [...field.options].filter((one) => !one.disabled);
  const next = all[all.indexOf(field.selectedOptions[0]) + by] ?? (around ? all[0] : null);
  if (!next || next.selected) return;
  next.selected = true;
  changed(field);
}

/** Changes a field, as its arrow keys do; false if the element is none. @param {HTMLElement} element @param {number} by */
function change(element, by) {
  if (element instanceof HTMLMediaElement) {
    element.currentTime = Math.max(0, element.currentTime + SKIP * by);
  } else if (element instanceof HTMLSelectElement) {
    choose(element, by);
  } else if (element instanceof HTMLInputElement && element.type === "range") {
    element.stepUp(by);
    changed(element);
  } else return false;
  return true;
}

/** Moves the focus to the nearest element at the right or the left, or changes a field. @param {number} by 1 or -1 */
export function aside(by) {
  const active = focused();
  if (change(active, by)) return;
  const middle = (/** @type {HTMLElement} */ one) => {
    const { left, top, width, height } = one.getBoundingClientRect();
    return [left + width / 2, top + height / 2];
  };
  const [x, y] = middle(active);
  let nearest, least = Infinity;
  for (const one of reachable(document)) {
    const [u, v] = middle(one), across = by * (u - x), way = across + ASIDE * Math.abs(v - y);
    if (across < 1 || way >= least || one.matches(HOLDS)) continue;
    nearest = one;
    least = way;
  }
  focus(nearest);
}

/** Uses the element with the focus, as the Enter key does. */
export function use() {
  const active = focused(), refused = () => showNotice(document, devices.refused);
  if (active instanceof HTMLMediaElement) {
    if (active.paused) active.play().catch(({ name }) => name === "NotAllowedError" && refused());
    else active.pause();
  } else if (active instanceof HTMLSelectElement) {
    choose(active, 1, true);
  } else {
    // A browser opens another page only for what it counts as a visitor's act.
    const opens = active.matches("a[target]") && navigator.userActivation?.isActive === false;
    active.click();
    if (opens) refused();
  }
}
