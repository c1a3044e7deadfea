// The tour of a walk: markers of labels, their panel, and the list of stops.

import { PageError } from "../net/errors.js";
import { keepPanelsAboveButtons } from "../ui/above.js";
import { addStyle, calm, find, make } from "../ui/elements.js";
import { checked, inLanguage, languageFor } from "./document.js";
import { fillLabel } from "./label.js";
import { Markers } from "./markers.js";
import { STYLE } from "./style.js";
import { tour as words } from "../words/english.js";
import { fill } from "../words/language.js";

/** Greatest movement of a click, pixels, and its longest time, ms. */
const STILL = 6, SHORT = 500;

/** @typedef {import("../app.js").App} App */

/**
 * Fetches the tour and attaches it to the page.
 * @param {App} app
 * @param {string} address of the document
 */
export async function attachTour(app, address) {
  const url = new URL(address, document.baseURI).href;
  try {
    const tour = await app.walk.stream.fetcher.whole(url, (body) => checked(JSON.parse(new TextDecoder().decode(body))));
    addTourStyle();
    return new Tour(app, tour, url);
  } catch (fault) {
    const code = fault instanceof PageError ? fault.code : "PTM-V105";
    app.walk.faults.push({ code, message: String(fault) });
    app.emit("notice", { message: words.unloaded });
    return null;
  }
}

export function addTourStyle() {
  addStyle(STYLE);
  keepPanelsAboveButtons(document);
}

export class Tour {
  /** The label that is open, and the stop of the visitor; -1 for none. */
  open = -1;
  stop = -1;
  /** Takes a click on the picture, pixels, in place of the labels. @type {((across: number, down: number) => void) | null} */
  pick = null;
  /** What had the focus before a label opened. @type {HTMLElement | null} */
  #before = null;

  /**
   * @param {App} app
   * @param {import("./document.js").Document} tour
   * @param {string} url of the document
   */
  constructor(app, tour, url) {
    this.app = app;
    this.tour = tour;
    this.url = url;
    const query = new URLSearchParams(location.search), asked = query.get("lang");
    this.language = languageFor(tour.languages, [...(asked ? [asked] : []), ...navigator.languages]);
    this.panel = make("section", { id: "label", ariaLabel: words.label, hidden: true });
    this.list = make("section", { id: "tour", ariaLabel: words.tour, tabIndex: 0, hidden: true });
    find(document, "#panels").append(this.list, this.panel);
    this.button = make("button", { "aria-controls": "tour", "aria-expanded": "false" }, words.tour);
    const nav = find(document, "nav"), narrow = matchMedia("(max-width: 640px)");
    this.button.onclick = () => this.#showList(this.list.hidden);
    // A narrow window has room for one panel.
    nav.addEventListener("click", (/** @type {Event} */ { target }) => {
      const other = /** @type {Element} */ (target).closest("[aria-controls]");
      if (!narrow.matches || !other || other.getAttribute("aria-expanded") !== "true") return;
      for (const open of nav.querySelectorAll("[aria-expanded=true]")) if (open !== other) open.click();
    });
    nav.prepend(this.button);
    this.markers = new Markers(app.walk, tour.labels, {
      nameOf: (label) => this.nameOf(label),
      open: (label) => this.show(label),
    });
    this.#fill();
    this.#listen();
    const label = tour.labels.findIndex(({ id }) => id === query.get("label")), stop = query.get("stop") ?? "";
    if (label >= 0) this.visit(label);
    else if (/^\d+$/.test(stop) && Number(stop) in tour.stops) this.go(Number(stop));
  }

  /** The version of a text for the visitor. @template T @param {Record<string, T> | undefined} texts */
  choose = (texts) => inLanguage(texts, this.language, this.tour.languages[0]);

  /** Title and maker of a label. @param {number} label */
  nameOf(label) {
    const { id, title, maker } = this.tour.labels[label];
    const parts = [this.choose(title)?.text ?? id, this.choose(maker)?.text];
    return parts.filter(Boolean).join(", ");
  }

  /** @param {number} stop */
  #titleOf(stop) {
    const { title, label } = this.tour.stops[stop];
    return this.choose(title)?.text ?? (label === undefined ? fill(words.stop, { number: stop + 1 }) : this.nameOf(label));
  }

  #listen() {
    const { app } = this, { canvas } = app;
    const follow = () => {
      if (app.walk.begun) this.markers.place(app.walker.pose);
      requestAnimationFrame(follow);
    };
    requestAnimationFrame(follow);
    /** @type {PointerEvent | null} */
    let down = null;
    canvas.addEventListener("pointerdown", (event) => (down = event.isPrimary ? event : null));
    canvas.addEventListener("pointerup", (event) => {
      if (!down || event.pointerId !== down.pointerId) return;
      const moved = Math.hypot(event.clientX - down.clientX, event.clientY - down.clientY);
      const slow = event.timeStamp - down.timeStamp > SHORT;
      down = null;
      if (moved > STILL || slow) return;
      if (this.pick) return this.pick(event.clientX, event.clientY);
      const label = this.markers.at(app.walker.pose, event.clientX, event.clientY);
      if (label >= 0) this.show(label);
    });
    addEventListener("keydown", ({ code, target, ctrlKey, altKey, metaKey }) => {
      if (ctrlKey || altKey || metaKey) return;
      if (target instanceof Element && target.closest("input, select, textarea, audio")) return;
      if (code === "KeyN") this.step(1);
      if (code === "KeyP") this.step(-1);
      if (code !== "Escape") return;
      if (!this.panel.hidden) this.close();
      else if (!this.list.hidden) this.#showList(false);
    });
  }

  /** Fills what is in the language of the visitor, besides the labels. */
  #fill() {
    this.#fillList();
    this.#name();
  }

  /** Names the page and the places. */
  #name() {
    const { title, places = {} } = this.tour, { config, index } = this.app, chosen = this.choose(title);
    // A title that `ptm publish` was given stays.
    if (chosen && config.title === inLanguage(title, "", this.tour.languages[0])?.text) {
      find(document, "title").lang = chosen.tag;
      document.title = String(chosen.text);
    }
    for (const place of index.viewpoints) {
      place.title = Object.hasOwn(places, place.description) ? this.choose(places[place.description]) : null;
    }
    for (const panel of ["#places", "#map"]) find(document, panel).dispatchEvent(new Event("rename"));
  }

  #fillList() {
    const { languages, stops, labels, title, description } = this.tour;
    const chosen = this.choose(title), about = this.choose(description);
    this.button.hidden = !(stops.length || labels.length || about || languages.length > 1);
    const heading = make("h2", { lang: chosen?.tag ?? "", dir: "auto" }, chosen?.text ?? words.tour);
    const rows = stops.map((_, stop) => {
      const button = make("button", { dir: "auto", onclick: () => this.go(stop) }, this.#titleOf(stop));
      if (stop === this.stop) button.setAttribute("aria-current", "true");
      return make("li", {}, button);
    });
    const options = languages.map((tag) => make("option", { value: tag, selected: tag === this.language }, named(tag)));
    const select = make("select", { ariaLabel: words.language, onchange: () => this.speak(select.value) }, ...options);
    const { catalogue: first = "" } = this.app.config;
    const catalogue = this.language === languages[0] ? first : first.replace(/(?=\.html$)/, `-${this.language}`);
    this.list.replaceChildren(
      heading,
      ...(about ? [make("p", { lang: about.tag, dir: "auto" }, String(about.text))] : []),
      ...(languages.length > 1 ? [select] : []),
      make("ol", {}, ...rows),
      ...(catalogue ? [make("p", {}, make("a", { href: catalogue }, words.catalogue))] : []),
    );
  }

  /** Shows everything in a language. @param {string} language */
  speak(language) {
    this.speakQuietly(language);
    find(this.list, "select").focus();
  }

  /** Shows everything in a language; the focus stays. @param {string} language */
  speakQuietly(language) {
    this.language = language;
    this.#fill();
    this.markers.rename();
    if (this.open >= 0) this.show(this.open, true);
  }

  /** @param {boolean} on */
  #showList(on) {
    this.list.hidden = !on;
    this.button.setAttribute("aria-expanded", String(on));
    if (!on && this.list.contains(document.activeElement)) this.button.focus();
  }

  /**
   * Shows a changed tour.
   * @param {import("./document.js").Document} tour
   */
  renew(tour) {
    this.tour = tour;
    this.markers.renew(tour.labels);
    if (!tour.languages.includes(this.language)) this.language = tour.languages[0];
    if (!(this.stop in tour.stops)) this.stop = -1;
    this.#fill();
    if (this.open in tour.labels) this.show(this.open, true);
    else if (!this.panel.hidden) this.close();
  }

  /** Opens a label; `quiet`: the focus stays, and no event says so. @param {number} label @param {boolean} [quiet] */
  show(label, quiet = false) {
    const { panel, tour } = this, active = document.activeElement;
    if (panel.hidden) this.#before = active instanceof HTMLElement ? active : null;
    this.open = this.markers.current = label;
    panel.hidden = false;
    if (matchMedia("(max-width: 640px)").matches) this.#showList(false);
    const ways = tour.stops.length > 1
      ? [{ text: words.previous, go: () => this.step(-1) }, { text: words.next, go: () => this.step(1) }]
      : [];
    const heading = fillLabel(panel, tour.labels[label], {
      choose: this.choose,
      urlOf: (file) => new URL(file, this.url).href,
      close: () => this.close(),
      ways,
    });
    if (quiet) return;
    heading.focus({ preventScroll: true });
    panel.scrollTop = 0;
    this.app.emit("label", tour.labels[label].id);
  }

  close() {
    const { panel } = this, inside = panel.contains(document.activeElement);
    panel.hidden = true;
    panel.replaceChildren();
    this.open = this.markers.current = -1;
    const back = this.#before?.isConnected ? this.#before : this.app.canvas;
    if (inside) back.focus();
  }

  /** Goes to the stop of a label, if it has one, and opens the label. @param {number} label */
  visit(label) {
    const stop = this.tour.stops.findIndex((one) => one.label === label);
    if (stop >= 0) this.go(stop);
    else this.show(label);
  }

  /** Goes to the next stop, or with -1 to the previous one. @param {number} by */
  step(by) {
    const { length } = this.tour.stops;
    if (length) this.go((Math.max(this.stop, by > 0 ? -1 : 0) + by + length) % length);
  }

  /** Goes to a stop. @param {number} stop */
  go(stop) {
    const { app, tour } = this, { position, direction: [x, y, z], label } = tour.stops[stop];
    const pitch = Math.asin(Math.max(-1, Math.min(1, y / Math.hypot(x, y, z))));
    this.stop = stop;
    app.follow({ eye: [...position], yaw: Math.atan2(-x, -z), pitch });
    if (!calm()) app.canvas.animate([{ opacity: 0 }, { opacity: 1 }], 250);
    this.#fillList();
    if (label !== undefined) this.show(label);
    else if (!this.panel.hidden) this.close();
  }
}

/** The name of a language in itself. @param {string} tag */
function named(tag) {
  try {
    return new Intl.DisplayNames([tag], { type: "language" }).of(tag) ?? tag;
  } catch {
    return tag;
  }
}
