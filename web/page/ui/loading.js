// Shows the progress until the first picture, in the bar that the page contains.

import { find } from "./elements.js";

/** @param {Document} root @param {Pick<import("./all.js").App, "on">} app */
export function attachLoading(root, app) {
  const bar = find(root, "#progress"), stage = find(root, "#stage");
  app.on("progress", ({ stage: text, loaded, total }) => {
    stage.textContent = text;
    if (total > 0) {
      bar.max = total;
      bar.value = loaded;
    } else {
      bar.removeAttribute("value");
    }
  });
  app.on("first-picture", () => root.body.classList.add("begun"));
}
