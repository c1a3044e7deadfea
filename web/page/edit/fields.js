// The fields of a form: texts in the language of the tab, choices, and the tabs themselves.

import { make } from "../ui/elements.js";
import { isCommon, putCommon, putText, textIn } from "./draft.js";

/** The name of a language, with its tag. @param {string} tag */
export function languageName(tag) {
  try {
    return `${new Intl.DisplayNames(undefined, { type: "language" }).of(tag)} (${tag})`;
  } catch {
    return tag;
  }
}

let numbers = 0;

/**
 * A label over an element, and a hint below.
 * @param {string} name @param {HTMLElement} element @param {string} [hint] @param {...HTMLElement} more beside the label
 */
export function labelled(name, element, hint = "", ...more) {
  const id = (element.id ||= `edit-${++numbers}`);
  const below = hint ? [make("small", { id: `${id}-hint` }, hint)] : [];
  if (hint) element.setAttribute("aria-describedby", `${id}-hint`);
  const head = make("div", { className: "head" }, make("label", { htmlFor: id }, name), ...more);
  return make("div", { className: "field" }, head, element, ...below);
}

/**
 * A text of a row.
 * @param {import("./editor.js").Editor} editor
 * @param {import("./draft.js").Row} row
 * @param {string} name of the field
 * @param {string} title of the field for people
 * @param {{long?: boolean, hint?: string, options?: string[], keep?: () => void}} [kind] `options`: files to choose
 *   from; `keep`: puts a new row into the document
 */
export function textField(editor, row, name, title, { long = false, hint = "", options, keep = () => {} } = {}) {
  const { draft, language } = editor, first = draft.languages[0];
  const value = textIn(row, name, language), common = isCommon(row, name);
  const step = `change of ${title.toLowerCase()}`;
  const write = () => editor.step(step, () => {
    putText(row, name, language, input.value);
    keep();
  }, `${name} ${language}`);
  const properties = { "data-field": name, dir: "auto", lang: common ? "" : language, value };
  const known = options && [...new Set([...options, ...(value ? [value] : [])])];
  const input = known
    ? make("select", properties, make("option", { value: "" }, "none"),
      ...known.map((file) => make("option", { value: file, selected: file === value }, file)))
    : make(long ? "textarea" : "input", { ...properties, rows: 7 });
  // A translator sees the text of the first language.
  if (!known && !common && language !== first) input.placeholder = textIn(row, name, first);
  input[known ? "onchange" : "oninput"] = write;
  input.onblur = () => draft.pause();
  if (draft.languages.length < 2) return labelled(title, input, hint);
  const all = make("input", { type: "checkbox", checked: common });
  all.onchange = () => {
    editor.step(step, () => {
      putCommon(row, name, all.checked, language, first);
      keep();
    });
    editor.refresh(name);
  };
  return labelled(title, input, hint, make("label", { className: "all" }, all, "all languages"));
}

/**
 * The tabs of the languages, and the way to more of them.
 * @param {import("./editor.js").Editor} editor
 */
export function languageTabs(editor) {
  const { languages } = editor.draft;
  /** @param {string} tag */
  const speak = (tag) => {
    editor.language = tag;
    editor.tour?.speakQuietly(tag);
    editor.refresh();
    /** @type {HTMLElement | null} */ (editor.root.querySelector('[aria-selected="true"]'))?.focus();
  };
  const tabs = languages.map((tag) => {
    const selected = tag === editor.language;
    return make("button", {
      role: "tab", "aria-selected": String(selected), tabIndex: selected ? 0 : -1, onclick: () => speak(tag),
    }, languageName(tag));
  });
  const list = make("div", { role: "tablist", ariaLabel: "Language of the texts" }, ...tabs);
  list.onkeydown = (/** @type {KeyboardEvent} */ { code }) => {
    const by = code === "ArrowRight" ? 1 : code === "ArrowLeft" ? -1 : 0;
    const at = languages.indexOf(editor.language) + by;
    if (by && languages[at]) speak(languages[at]);
  };
  return list;
}
