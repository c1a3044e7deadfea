// What is seen before the first picture: the poster and the bar, which are in the page as it comes.

import { find } from "./elements.js";

/** @param {Document} root @param {Pick<import("./all.js").App, "on">} app */
export function attachLoading(root, app) {
  const bar = find(root, "#progress"), stage = find(root, "#stage");
  app.on("progress", ({ stage: what, loaded, total }) => {
    stage.textContent = what;
    if (total > 0) {
      bar.max = total;
      bar.value = loaded;
    } else {
      bar.removeAttribute("value");
    }
  });
  app.on("first-picture", () => root.body.classList.add("begun"));
}
