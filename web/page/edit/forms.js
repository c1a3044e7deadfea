// The forms of the editor: the list of stops and labels, a label, a stop without a label.

import { make } from "../ui/elements.js";
import { put } from "./draft.js";
import { labelled, languageName, languageTabs, textField } from "./fields.js";

/** @typedef {import("./editor.js").Editor} Editor */

/** Languages that are proposed. */
const COMMON_LANGUAGES = "en de fr es it nl pt pl cs sv da fi hu el tr uk ru ar he hi ja ko zh".split(" ");
const LANGUAGE = "[A-Za-z]{2,3}(-[A-Za-z0-9]{2,8})*";

/** @param {string} text @param {() => void} onclick @param {Record<string, any>} [more] */
export const button = (text, onclick, more = {}) => make("button", { type: "button", onclick, ...more }, text);

/** The whole tour. @param {Editor} editor */
export function listForm(editor) {
  const { draft } = editor;
  const rows = draft.stops.map((_, number) => {
    const name = editor.nameOfStop(number), last = draft.stops.length - 1;
    return make("li", {},
      button(name, () => editor.openStop(number), { className: "name", dir: "auto" }),
      button("↑", () => editor.move(number, -1), { ariaLabel: `Move ${name} up`, disabled: number === 0 }),
      button("↓", () => editor.move(number, 1), { ariaLabel: `Move ${name} down`, disabled: number === last }),
    );
  });
  const free = draft.labels.flatMap(({ id }, number) => (draft.stopOf(id) < 0 ? [number] : []));
  return [
    make("p", { className: "row" },
      button("Add label", () => editor.add(), { className: "main" }),
      button("Add stop here", () => editor.addStop())),
    make("h3", {}, "Stops of the tour, in order"),
    ...(rows.length ? [make("ol", {}, ...rows)] : [make("p", { className: "dim" }, "No stops yet.")]),
    ...(free.length
      ? [make("h3", {}, "Labels without a stop"), make("ul", {}, ...free.map((number) =>
        make("li", {}, button(editor.nameOf(number), () => editor.open(number), { className: "name", dir: "auto" }))))]
      : []),
    make("h3", {}, "The walk"),
    languageTabs(editor),
    textField(editor, draft.document, "title", "Title"),
    textField(editor, draft.document, "description", "Description"),
    placesForm(editor),
    ...languageForm(editor),
  ];
}

/** The names of the places, in the language of the tab. @param {Editor} editor */
function placesForm(editor) {
  const { draft, loaded } = editor, places = draft.document.places ?? {};
  const keep = () => {
    if (Object.keys(places).length) draft.document.places = places;
    else delete draft.document.places;
  };
  const names = [...new Set([...loaded.places, ...Object.keys(places)])];
  return make("details", { open: editor.opened.has("places"), ontoggle: editor.toggled("places") },
    make("summary", {}, "Names of the places"),
    ...names.map((name) => textField(editor, places, name, name, { keep })));
}

/** Languages to add and remove. @param {Editor} editor */
function languageForm(editor) {
  const { draft } = editor;
  const options = COMMON_LANGUAGES.filter((tag) => !draft.languages.includes(tag));
  const list = make("datalist", { id: "edit-languages" },
    ...options.map((tag) => make("option", { value: tag }, languageName(tag))));
  const tag = make("input", { "data-field": "languages", placeholder: "de", pattern: LANGUAGE });
  tag.setAttribute("list", list.id);
  const add = () => {
    const value = tag.value.trim();
    const known = draft.languages.some((one) => one.toLowerCase() === value.toLowerCase());
    if (!value || !tag.checkValidity() || known) return editor.say("Write the tag of another language, such as de or pt-BR.");
    editor.step(`add ${value}`, () => draft.languages.push(value));
    editor.language = value;
    editor.refresh();
  };
  const others = draft.languages.slice(1).map((one) => button(`Remove ${languageName(one)}`, () => {
    editor.step(`remove ${languageName(one)}`, () => draft.removeLanguage(one));
    editor.refresh();
  }));
  return [
    make("details", { open: editor.opened.has("languages"), ontoggle: editor.toggled("languages") },
      make("summary", {}, "Languages"),
      labelled("Another language", tag, "Its tag, such as de, fr or pt-BR."), list,
      make("p", { className: "row" }, button("Add language", add), ...others)),
  ];
}

/** A label. @param {Editor} editor @param {number} number */
export function labelForm(editor, number) {
  const { draft, loaded } = editor, row = draft.labels[number], stop = draft.stopOf(row.id);
  const id = make("input", { value: row.id, "data-field": "id", pattern: "[a-z0-9][a-z0-9_\\-]*", maxLength: 64 });
  id.onchange = () => {
    const taken = draft.labels.some((other) => other !== row && other.id === id.value);
    if (taken || !id.value || !id.checkValidity()) {
      id.value = row.id;
      return editor.say("A name in addresses has letters a to z, digits, - and _, and only one label has it.");
    }
    editor.step("change of the name in addresses", () => draft.rename(number, id.value));
  };
  return [
    back(editor),
    make("h3", {}, "What the label describes"),
    whatForm(editor, row),
    make("h3", {}, "Texts"),
    languageTabs(editor),
    textField(editor, row, "title", "Title"),
    textField(editor, row, "maker", "Maker"),
    textField(editor, row, "date", "Date"),
    textField(editor, row, "text", "Text", {
      long: true, hint: "*italic*, **bold**, [words](https://example.org), lines that begin with - for a list",
    }),
    textField(editor, row, "image", "Description of the picture", { hint: "For visitors who do not see it." }),
    textField(editor, row, "link", "Link", { hint: "https://…" }),
    textField(editor, row, "sound", "Sound", {
      options: loaded.sounds, hint: loaded.sounds.length ? "" : "Put .mp3, .m4a, .ogg, .opus or .wav files beside tour.json.",
    }),
    ...(row.sound || row.captions
      ? [textField(editor, row, "captions", "Captions of the sound", { options: loaded.captions, hint: "WebVTT (.vtt)" })]
      : []),
    make("h3", {}, "Stop of the tour"),
    ...(stop < 0
      ? [make("p", { className: "row" }, button("Make a stop of this view", () => editor.addStop(row.id)))]
      : stopForm(editor, stop)),
    make("details", { open: editor.opened.has("more"), ontoggle: editor.toggled("more") },
      make("summary", {}, "Name in addresses"),
      labelled("Name", id, `?label=${row.id} behind the address of the page leads to this label.`)),
    make("p", { className: "row" }, button("Delete label", () => editor.remove(number), { className: "delete" })),
  ];
}

/** The object, the room or the place of a label. @param {Editor} editor @param {import("./draft.js").Row} row */
function whatForm(editor, row) {
  /** @type {[string, any][]} name, and the field with its value */
  const choices = [];
  /** @param {string} name @param {string} value */
  const offer = (name, value) => {
    if (!choices.some(([, old]) => old[0] === name && old[1] === value)) choices.push([`${name}: ${value}`, [name, value]]);
  };
  for (const name of ["object", "room"]) if (row[name]) offer(name, row[name]);
  const picks = editor.picks.get(row.id) ?? [];
  for (const { object } of picks) if (object) offer("object", object);
  for (const room of editor.loaded.rooms) offer("room", room);
  const at = row.at ?? picks.at(-1)?.at;
  if (at) choices.push([`place: ${at.map((/** @type {number} */ x) => x.toFixed(2)).join(", ")} m`, ["at", at]]);
  const select = make("select", { "data-field": "object" }, ...choices.map(([text, [name]], k) =>
    make("option", { value: k, selected: name in row && (name === "at" || text === `${name}: ${row[name]}`) }, text)));
  select.onchange = () => {
    const [name, value] = choices[Number(select.value)][1];
    editor.step("change of the object", () => describe(row, name, value));
  };
  return make("div", {},
    labelled("Object, room or place", select),
    make("p", { className: "row" }, button("Click on another object", () => editor.add(row))));
}

/** Makes a label that of an object, a room or a place. @param {import("./draft.js").Row} row @param {string} name @param {any} value */
export function describe(row, name, value) {
  for (const other of ["object", "room", "at"]) if (other !== name) put(row, other, undefined);
  put(row, name, value);
}

/** The view of a stop. @param {Editor} editor @param {number} number */
function stopForm(editor, number) {
  const { length } = editor.draft.stops;
  const place = make("input", { type: "number", min: 1, max: length, value: number + 1, "data-field": "place" });
  place.onchange = () => {
    if (place.checkValidity() && place.value) editor.place(number, Number(place.value) - 1);
    editor.refresh("place");
  };
  return [
    labelled(`Place in the order, of ${length}`, place),
    make("p", { className: "row" },
      button("Set the view from here", () => editor.setView(number)),
      button("Go to it", () => editor.goTo(number))),
    make("p", { className: "row" }, button("Remove the stop", () => editor.removeStop(number))),
  ];
}

/** A stop that opens no label. @param {Editor} editor @param {number} number */
export function placeForm(editor, number) {
  return [
    back(editor),
    make("h3", {}, "A stop without a label"),
    languageTabs(editor),
    textField(editor, editor.draft.stops[number], "title", "Title"),
    ...stopForm(editor, number),
  ];
}

/** @param {Editor} editor */
const back = (editor) => button("← All stops and labels", () => editor.list(), { className: "back" });

