// The script of a walk in a frame of another page, of walks without an interface (`?ui=none`), kiosks, gamepads and
// headsets: it tells that page about the visit, and lets it lead the visitor. See docs/formats/embedding.md.

import { attachKiosk } from "./kiosk.js";
import { attachDevices } from "./ui/devices.js";
import { addStyle } from "./ui/elements.js";

const FORMAT = "ptm-walk";
/** @param {any[]} list @param {any} number */
const isOf = (list, number) => Number.isInteger(number) && number in list;

/** @param {import("./app.js").App} app */
export function attachEmbedding(app) {
  const query = new URLSearchParams(location.search), ui = (query.get("ui") ?? "").split(",");
  if (ui.includes("none")) addStyle("nav { display: none; }");
  if (ui.includes("kiosk")) attachKiosk(app, query);
  attachDevices(app, ui);
  if (parent === window) return;
  /** @param {string} event @param {Record<string, any>} [detail] nothing about the visitor but where he is */
  const tell = (event, detail = {}) => parent.postMessage({ format: FORMAT, event, ...detail }, "*");
  const ready = () => tell("ready", { title: app.config.title });
  if (app.walk.begun) ready();
  else app.on("first-picture", ready);
  app.on("cell", (cell) => {
    const place = app.index.viewpoints.find((row) => row.cell === cell), name = place?.description ?? "";
    tell("room", { cell, name, title: place?.title?.text ?? name });
  });
  app.on("label", (id) => tell("label", { id }));
  addEventListener("message", ({ source, data }) => {
    if (source !== parent || data?.format !== FORMAT) return;
    const { place, label, stop } = data.goTo ?? {}, { tour } = app;
    if (isOf(app.index.viewpoints, place)) app.goTo(place);
    if (!tour) return;
    const number = tour.tour.labels.findIndex(({ id }) => id === label);
    if (number >= 0) tour.visit(number);
    if (isOf(tour.tour.stops, stop)) tour.go(stop);
  });
}
