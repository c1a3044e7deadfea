// The menu of viewpoints.

import { calm, make } from "./elements.js";
import { panels } from "../words/english.js";

/** @param {HTMLElement} root the panel @param {import("./all.js").App} app */
export function attachMenu(root, app) {
  const base = new URL(app.config.index, document.baseURI);
  const rows = app.index.viewpoints.map(({ description, name, thumbnail }, k) => {
    const button = make("button", {}, description || name);
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
}
