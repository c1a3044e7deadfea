// The editor of the tour: what is chosen, what changes, and when it is shown, saved or refused.
//
// The server checks each version of the draft and returns it as visitors see it. The page shows that beside
// the form: a text is Markdown in one program only.

import { loadTour } from "../load-later.js";
import { addStyle, find, make } from "../ui/elements.js";
import { Draft, textIn } from "./draft.js";
import { button, describe, labelForm, listForm, placeForm } from "./forms.js";
import { Refusal, Server, tokenOf } from "./requests.js";
import { STYLE } from "./style.js";

/** Rest after a change until the page shows it, ms. */
const REST = 250;
/** Digits of a position in metres, and of a direction. */
const POSITION = 3, DIRECTION = 4;

/** @typedef {import("../app.js").App} App */
/** @typedef {import("./draft.js").Row} Row */

/** @param {number} value @param {number} digits */
const rounded = (value, digits) => Number(value.toFixed(digits));

/** Waits for the application. @returns {Promise<App>} */
const application = () => new Promise((resolve) => {
  const look = () => {
    const { ptm } = /** @type {{ptm?: App}} */ (/** @type {any} */ (window));
    if (ptm) resolve(ptm);
    else requestAnimationFrame(look);
  };
  look();
});

export async function attachEditor() {
  const server = new Server(tokenOf());
  const app = await application();
  addStyle(STYLE);
  const root = make("section", { id: "edit", ariaLabel: "Edit the tour" });
  find(document, "#panels").prepend(root);
  try {
    const [loaded, { Tour, addTourStyle }] = await Promise.all([server.load(), loadTour()]);
    addTourStyle();
    const tour = new Tour(app, loaded.shown, new URL("edit/media/", document.baseURI).href);
    app.tour = tour;
    Object.assign(window, { editor: new Editor(app, server, loaded, tour, root) });
  } catch (fault) {
    root.append(make("header", {}, make("h2", {}, "The tour cannot be edited"), make("p", {}, textOf(fault))));
  }
}

/** What is wrong, for people. @param {unknown} fault */
function textOf(fault) {
  if (fault instanceof Refusal) {
    const { place, message, remedy, code } = fault;
    const text = `${place && `${place}: `}${message}${remedy && `; ${remedy}`}${code && ` [${code}]`}`;
    return text[0].toUpperCase() + text.slice(1);
  }
  return "The server does not answer. Is `ptm serve` still running? What you wrote is still here.";
}

export class Editor {
  /** The label or the stop in the form, or neither. @type {{label: number} | {stop: number} | null} */
  #chosen = null;
  /** Objects that were met where a label was placed, by its id. @type {Map<string, import("./requests.js").Pick[]>} */
  picks = new Map();
  /** Details that are open. @type {Set<string>} */
  opened = new Set();
  #timer = 0;
  /** Counts previews: an answer that another overtook is not shown. */
  #asked = 0;
  #saving = false;

  /**
   * @param {App} app @param {Server} server @param {import("./requests.js").Loaded} loaded
   * @param {import("../tour/tour.js").Tour} tour @param {HTMLElement} root
   */
  constructor(app, server, loaded, tour, root) {
    this.app = app;
    this.server = server;
    this.loaded = loaded;
    this.tour = tour;
    this.root = root;
    this.draft = new Draft(loaded.document, loaded.tag);
    this.language = tour.language;
    this.said = make("p", { className: "said", role: "status" });
    this.body = make("div", { className: "body" });
    this.conflict = make("div", { className: "conflict", role: "alert", hidden: true });
    this.saving = button("Save", () => this.save(), { className: "main", title: "Ctrl+S" });
    this.undoing = button("Undo", () => this.undo());
    root.append(
      make("header", {}, make("h2", {}, "Edit the tour"), make("small", {}, loaded.file)),
      this.body,
      this.conflict,
      make("footer", {}, this.said, make("p", { className: "row" }, this.undoing, this.saving)),
    );
    app.on("label", (id) => {
      this.#aim(null);
      const label = this.draft.labels.findIndex((row) => row.id === id);
      if (label >= 0 && label !== this.#label) this.#form({ label });
    });
    addEventListener("beforeunload", (event) => {
      if (this.draft.changed) event.preventDefault();
    });
    addEventListener("keydown", (event) => this.#key(event));
    this.refresh();
  }

  /** The label in the form, or -1. */
  get #label() {
    return this.#chosen && "label" in this.#chosen ? this.#chosen.label : -1;
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    const { code, target } = event, writing = target instanceof Element && target.closest("input, textarea, select");
    if ((event.ctrlKey || event.metaKey) && !event.altKey && !event.shiftKey) {
      if (code === "KeyS") {
        event.preventDefault();
        this.save();
      } else if (code === "KeyZ" && !writing) {
        event.preventDefault();
        this.undo();
      }
    } else if (this.tour.pick && code === "Escape") {
      this.#aim(null);
    } else if (this.tour.pick && code === "Enter" && target === this.app.canvas) {
      const { clientWidth, clientHeight } = this.app.canvas;
      this.tour.pick(clientWidth / 2, clientHeight / 2);
    }
  }

  /** @param {string} text @param {boolean} [wrong] */
  say(text, wrong = false) {
    this.said.textContent = text;
    this.said.classList.toggle("wrong", wrong);
  }

  /** @param {string} name of details @returns {(event: Event) => void} */
  toggled = (name) => ({ target }) => {
    if (/** @type {HTMLDetailsElement} */ (target).open) this.opened.add(name);
    else this.opened.delete(name);
  };

  /** The title of a label. @param {number} number */
  nameOf(number) {
    const row = this.draft.labels[number];
    return textIn(row, "title", this.language) || textIn(row, "title", this.draft.languages[0]) || row.id;
  }

  /** @param {number} number */
  nameOfStop(number) {
    const row = this.draft.stops[number], label = this.draft.labels.findIndex(({ id }) => id === row.label);
    const title = textIn(row, "title", this.language) || textIn(row, "title", this.draft.languages[0]);
    return title || (label < 0 ? `Stop ${number + 1}` : this.nameOf(label));
  }

  /** Fills the form again; the field of a name gets the focus. @param {string} [field] */
  refresh(field) {
    const { draft } = this, chosen = this.#chosen;
    if (!draft.languages.includes(this.language)) this.language = draft.languages[0];
    const top = this.body.scrollTop;
    const label = this.#label in draft.labels ? this.#label : -1;
    const stop = chosen && "stop" in chosen && chosen.stop in draft.stops ? chosen.stop : -1;
    if (label < 0 && stop < 0) this.#chosen = null;
    const form = label >= 0 ? labelForm(this, label) : stop >= 0 ? placeForm(this, stop) : listForm(this);
    this.body.replaceChildren(...form);
    this.body.scrollTop = top;
    if (field) this.#field(field)?.focus();
    this.#status();
  }

  /** @param {string} name @returns {HTMLElement | null} */
  #field(name) {
    return this.body.querySelector(`[data-field="${CSS.escape(name)}"]`);
  }

  #status() {
    const { changed, last } = this.draft;
    this.saving.disabled = !changed || this.#saving;
    this.undoing.disabled = !last;
    this.undoing.title = last ? `Undo: ${last}` : "";
    if (!this.said.classList.contains("wrong")) this.say(changed ? "Not saved yet." : "Everything is saved.");
  }

  /** Changes the draft, and shows it. @param {string} name @param {() => void} change @param {string} [key] */
  step(name, change, key = "") {
    const chosen = JSON.stringify(this.#chosen);
    this.draft.step(name, change, key && `${chosen} ${key}`);
    this.#changed();
  }

  #changed() {
    this.#status();
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => this.preview(), REST);
  }

  /** Shows the draft on the page, or what is wrong with it. */
  async preview() {
    const asked = ++this.#asked;
    try {
      const { shown } = await this.server.preview(this.draft.document);
      if (asked === this.#asked) this.#show(shown);
    } catch (fault) {
      if (asked === this.#asked) this.#refused(fault);
    }
  }

  /** @param {import("./requests.js").Shown} shown */
  #show(shown) {
    for (const element of this.body.querySelectorAll("[aria-invalid]")) element.removeAttribute("aria-invalid");
    this.say("");
    this.#status();
    this.tour.language = this.language;
    this.tour.renew(shown);
    if (this.#label in shown.labels && this.#label !== this.tour.open) this.tour.show(this.#label, true);
  }

  /** Says what is wrong with the draft, at the field in question. @param {unknown} fault */
  #refused(fault) {
    const [, kind, number, field, rest] = fault instanceof Refusal
      ? /^(labels|stops)\[(\d+)\](?:\.(\w+))?(.*)$/.exec(fault.place) ?? [] : [];
    if (!kind || !(fault instanceof Refusal)) return this.say(textOf(fault), true);
    const name = kind === "labels" ? this.nameOf(Number(number)) : this.nameOfStop(Number(number));
    const where = [`“${name}”`, field, rest?.replace(".", "")].filter(Boolean).join(", ");
    this.say(`Cannot be saved yet: ${where}: ${fault.message}`, true);
    const chosen = this.#chosen;
    const here = chosen && (kind === "labels" ? "label" in chosen && chosen.label : "stop" in chosen && chosen.stop);
    if (here === Number(number) && field) this.#field(field)?.setAttribute("aria-invalid", "true");
  }

  undo() {
    const { last } = this.draft;
    if (!last) return;
    this.draft.undo();
    this.refresh();
    this.#changed();
    this.say(`Undone: ${last}.`);
  }

  /** @param {{label: number} | {stop: number} | null} chosen @param {string} [field] that gets the focus */
  #form(chosen, field = "") {
    this.draft.pause();
    this.#chosen = chosen;
    this.body.scrollTop = 0;
    this.refresh(field);
  }

  /** Shows all stops and labels. */
  list() {
    this.#form(null);
    this.body.querySelector("button")?.focus();
  }

  /** Shows a label in the form, and as visitors see it. @param {number} number */
  open(number) {
    this.#form({ label: number }, "title");
    if (number in this.tour.tour.labels) this.tour.show(number, true);
  }

  /** @param {number} number */
  openStop(number) {
    const label = this.draft.labels.findIndex(({ id }) => id === this.draft.stops[number].label);
    this.goTo(number);
    if (label >= 0) this.open(label);
    else this.#form({ stop: number }, "title");
  }

  /** @param {number} number */
  goTo(number) {
    const { position, direction: [x, y, z] } = this.draft.stops[number].view;
    const pitch = Math.asin(Math.max(-1, Math.min(1, y / Math.hypot(x, y, z))));
    this.app.follow({ eye: [...position], yaw: Math.atan2(-x, -z), pitch });
  }

  /** The view of the visitor, as a stop has it. */
  get view() {
    const { eye, yaw, pitch } = this.app.walker.pose, flat = Math.cos(pitch);
    const direction = [-Math.sin(yaw) * flat, Math.sin(pitch), -Math.cos(yaw) * flat];
    return {
      position: Array.from(eye, (x) => rounded(x, POSITION)),
      direction: direction.map((x) => rounded(x, DIRECTION)),
    };
  }

  /** @param {number} number */
  setView(number) {
    this.step("change of the view", () => (this.draft.stops[number].view = this.view));
    this.say("The stop has this view now.");
  }

  /** Adds a stop with the view of the visitor. @param {string} [label] the id of its label */
  addStop(label) {
    this.step("add a stop", () => this.draft.stops.push({ ...(label ? { label } : {}), view: this.view }));
    if (label) this.refresh();
    else this.#form({ stop: this.draft.stops.length - 1 }, "title");
  }

  /** @param {number} number */
  removeStop(number) {
    this.step(`remove the stop “${this.nameOfStop(number)}”`, () => this.draft.stops.splice(number, 1));
    this.refresh();
  }

  /** Moves a stop up with -1, down with 1. @param {number} number @param {number} by */
  move(number, by) {
    this.place(number, number + by);
    this.refresh();
    const way = (/** @type {number} */ up) => [...this.body.querySelectorAll("ol li")][number + by]?.querySelectorAll("button")[up];
    const same = way(by < 0 ? 1 : 2);
    (same?.disabled ? way(by < 0 ? 2 : 1) : same)?.focus();
  }

  /** Moves a stop to another place in the order. @param {number} number @param {number} to */
  place(number, to) {
    const { stops } = this.draft;
    this.step(`move “${this.nameOfStop(number)}”`, () => stops.splice(to, 0, ...stops.splice(number, 1)));
    if (this.#chosen && "stop" in this.#chosen) this.#chosen.stop = to;
  }

  /** @param {number} number of a label */
  remove(number) {
    const name = this.nameOf(number);
    this.step(`delete “${name}”`, () => this.draft.removeLabel(number));
    this.tour.close();
    this.list();
    this.say(`“${name}” is deleted. Undo brings it back.`);
  }

  /** Lets the visitor click on an object, for a new label or an old one. @param {Row} [row] */
  add(row) {
    this.#aim(async (across, down) => {
      const { eye, ray } = this.tour.markers.rayAt(this.app.walker.pose, across, down);
      try {
        const { picks } = await this.server.pick(eye, ray);
        if (!picks.length) return this.say("There is nothing at this place. Click on an object.");
        this.#aim(null);
        this.#place(picks, row);
      } catch (fault) {
        this.say(textOf(fault), true);
      }
    });
  }

  /** @param {((across: number, down: number) => void) | null} pick */
  #aim(pick) {
    document.querySelector("#aim")?.remove();
    document.body.classList.toggle("aiming", pick !== null);
    this.tour.pick = pick;
    if (!pick) return;
    document.body.append(make("div", { id: "aim" }, make("p", { role: "status" },
      "Click on the object that the label describes. Drag or walk to it first, if you like. "
      + "Enter takes the object in the circle, Esc ends.")));
    this.app.canvas.focus({ preventScroll: true });
  }

  /** Makes a label of what was met, or gives it to an old one. @param {import("./requests.js").Pick[]} picks @param {Row} [row] */
  #place(picks, row) {
    const { draft } = this;
    // What is behind glass; else the nearest object.
    const best = picks.filter(({ object }) => object).at(-1) ?? picks[picks.length - 1];
    const [name, value] = best.object ? ["object", best.object] : ["at", best.at];
    if (row) {
      this.picks.set(row.id, picks);
      this.step("change of the object", () => describe(row, name, value));
      return this.refresh("object");
    }
    const known = draft.labels.findIndex(({ object }) => best.object && object === best.object);
    if (known >= 0) {
      this.open(known);
      return this.say("This object has a label already: here it is.");
    }
    const id = draft.idFor(best.object || "place");
    this.picks.set(id, picks);
    this.step("add a label", () => {
      draft.labels.push({ id, [name]: value });
      draft.stops.push({ label: id, view: this.view });
    });
    this.#form({ label: draft.labels.length - 1 }, "title");
    // The page shows it with the answer.
    this.tour.close();
  }

  async save() {
    const { draft } = this;
    if (this.#saving || !draft.changed) return;
    const text = JSON.stringify(draft.document);
    this.#saving = true;
    this.say("");
    this.#status();
    try {
      const { shown, tag } = await this.server.save(JSON.parse(text), draft.tag);
      draft.keep(tag, text);
      this.conflict.hidden = true;
      if (!draft.changed) this.#show(shown);
    } catch (fault) {
      if (fault instanceof Refusal && fault.status === 412) this.#conflict();
      else this.#refused(fault);
    }
    this.#saving = false;
    this.#status();
  }

  /** Another program has changed the file: which version stays? */
  #conflict() {
    const load = async (/** @type {boolean} */ mine) => {
      try {
        const loaded = await this.server.load();
        this.conflict.hidden = true;
        if (mine) {
          this.draft.tag = loaded.tag;
          return this.save();
        }
        this.draft.replace(loaded.document, loaded.tag);
        this.refresh();
        this.#show(loaded.shown);
        this.say("This is the file as it is now. Undo brings your version back.");
      } catch (fault) {
        this.say(textOf(fault), true);
      }
    };
    this.conflict.replaceChildren(
      make("p", {}, "Nothing was saved: another program has changed the file since this page loaded it."),
      make("p", { className: "row" },
        button("Load the file", () => load(false)), button("Save mine over it", () => load(true))),
    );
    this.conflict.hidden = false;
    this.conflict.querySelector("button")?.focus();
  }
}
