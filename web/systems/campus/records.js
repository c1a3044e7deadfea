// Records of objects: HTML beside the view (the paper's II.B). A record may be hostile. It is shown in a frame
// whose sandbox allows nothing: no scripts, forms, pop-ups or navigation of the page, in an origin of its own.
// Its policy, which comes before it, allows no requests either: images are in data URLs. Plain text would lose
// what records are for, headings, tables and pictures; a list of allowed tags would have to be right about each.

import { make } from "../../page/ui/elements.js";
import { showNotice } from "../../page/ui/errors.js";
import { nameOf } from "./labels.js";
import { form } from "../../page/words/english.js";

const POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; media-src data:; font-src data:";
const HEAD = `<!doctype html><meta charset="utf-8"><meta http-equiv="Content-Security-Policy" content="${POLICY}">
<style>:root { color-scheme: dark; font: 16px/1.5 system-ui, sans-serif; } img { max-width: 100%; }</style>`;

export class Records {
  /** The object whose record is wanted. @type {import("./index.js").CampusObject | null} */
  #wanted = null;

  /** @param {Document} root @param {import("./files.js").CampusFiles} files */
  constructor(root, files) {
    this.root = root;
    this.files = files;
    this.title = make("h2");
    const close = make("button", { textContent: form.close, onclick: () => this.close() });
    this.panel = make("aside", { id: "record", hidden: true, ariaLabel: form.record }, make("header", {}, this.title, close));
    root.body.append(this.panel);
    addEventListener("keydown", ({ key }) => {
      if (key === "Escape") this.close();
    });
  }

  /** Shows the record of an object; without one, closes that of another.
   * @param {import("./index.js").CampusObject} object */
  async show(object) {
    this.close();
    if (!object.record) return;
    this.#wanted = object;
    let html;
    try {
      html = await this.files.record(object.record);
    } catch (fault) {
      return showNotice(this.root, /** @type {Error} */ (fault).message);
    }
    if (this.#wanted !== object) return;
    this.title.textContent = nameOf(object);
    // An attribute of the sandbox that is set later would not hold for the document in the frame.
    this.panel.append(make("iframe", { title: nameOf(object), sandbox: "", srcdoc: HEAD + html }));
    this.panel.hidden = false;
  }

  close() {
    this.#wanted = null;
    this.panel.hidden = true;
    this.panel.querySelector("iframe")?.remove();
  }
}
