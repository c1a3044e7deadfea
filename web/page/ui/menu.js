// The menu of viewpoints.

import { calm, make } from "./elements.js";
import { panels } from "../words/english.js";

/** @param {HTMLElement} root the panel @param {import("./all.js").App} app */
export function attachMenu(root, app) {
  const base = new URL(app.config.index, document.baseURI);
  /** @type {HTMLElement[]} */
  const names = [];
  const rows = app.index.viewpoints.map(({ thumbnail }, k) => {
    const button = make("button", {}, (names[k] = make("span", { dir: "auto" })));
    if (thumbnail) {
      button.prepend(make("img", { src: new URL(thumbnail, base).href, alt: "", loading: "lazy" }));
    }
    button.onclick = () => {
      root.querySelector("[aria-current]")?.removeAttribute("aria-current");
      button.setAttribute("aria-current", "true");
      app.goTo(k);
      if (!calm()) app.canvas.animate([{ opacity: 0 }, { opacity: 1 }], 250);
    };
    return make("li", {}, button);
  });
  root.append(make("h2", {}, panels.places), make("ol", {}, ...rows));
  // A tour names the places in several languages.
  const rename = () => app.index.viewpoints.forEach(({ title, description, name }, k) => {
    names[k].lang = title?.tag ?? "";
    names[k].textContent = title?.text ?? (description || name);
  });
  rename();
  root.addEventListener("rename", rename);
}
