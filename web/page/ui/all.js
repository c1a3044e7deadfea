// The interface: controls and notices at once, panels when they are first opened.

import { loadLater } from "../load-later.js";
import { attachAddress } from "./address.js";
import { attachControls } from "./controls.js";
import { find } from "./elements.js";
import { attachErrors, showNotice } from "./errors.js";
import { attachLoading } from "./loading.js";
import { page } from "../words/english.js";

/**
 * The parts of the application that the interface uses.
 * @typedef {object} App
 * @property {{viewpoints: import("../data/site.js").Viewpoint[]}} index
 * @property {{index: string}} config the settings in the page
 * @property {import("../walk/walker.js").Walker} walker
 * @property {HTMLCanvasElement} canvas
 * @property {(place: number | import("../walk/walker.js").Pose) => void} goTo
 * @property {(pose: import("../walk/walker.js").Pose) => void} follow a link
 * @property {() => State} state
 * @property {() => Plan} plan
 * @property {{bytes: number} | null} measured budget of texture memory; 0 if none was fit
 * @property {(bytes: number) => void} setBudget of texture memory
 * @property {(seconds: number) => void} setPatience
 * @property {(name: string) => Promise<void>} setPolicy
 * @property {(on: boolean) => void} setDataSaver
 * @property {(on: boolean) => void} freeze
 * @property {(on: boolean) => void} compare
 * @property {<K extends keyof Events>(name: K, tell: (event: Events[K]) => void) => void} on
 */
/**
 * The numbers of the overlay.
 * @typedef {object} State
 * @property {number} cell -1 in none
 * @property {number[]} drawnCells
 * @property {number} residentBytes
 * @property {number} budgetBytes
 * @property {number} paperBytes
 * @property {number} requests
 * @property {number} bytes
 * @property {number} pending
 * @property {boolean} complete
 * @property {number} fps
 * @property {number} bandwidth bit/s
 * @property {number} latency s
 * @property {string} policy
 * @property {number[]} levels how many textures hold k levels, from none on
 * @property {number} [patience] s
 * @property {boolean} [dataSaver]
 */
/**
 * The plan for the map; without a record a cell has no leaves.
 * @typedef {object} Plan
 * @property {{cell: number, low: number[], high: number[], leaves?: {points: number[][]}[]}[]} cells
 * @property {number} here
 * @property {number[]} visible
 */
/**
 * @typedef {object} Events
 * @property {{stage: string, loaded: number, total: number}} progress
 * @property {void} first-picture
 * @property {number} cell
 * @property {{code: string, message: string}} error
 * @property {{message: string}} notice
 * @property {string} label the id of a label that opens
 */

/** Fill a panel. @type {Record<string, (panel: HTMLElement, app: App) => Promise<void>>} */
const PANELS = {
  places: async (panel, app) => (await loadLater()).attachMenu(panel, app),
  map: async (panel, app) => (await loadLater()).attachMinimap(panel, app),
  help: async (panel, app) => (await loadLater()).attachHelp(panel, app),
  details: async (panel, app) => (await loadLater()).attachOverlay(panel, app),
};

/** @param {Document} root @param {App} app */
function attachPanels(root, app) {
  /** @type {NodeListOf<HTMLButtonElement>} */
  const buttons = root.querySelectorAll("nav [aria-controls]");
  const narrow = matchMedia("(max-width: 640px)");
  /** @type {Map<string, Promise<void>>} */
  const filled = new Map();
  /** @param {HTMLButtonElement} button @param {boolean} open */
  const show = async (button, open) => {
    const name = button.getAttribute("aria-controls") ?? "", panel = find(root, `#${name}`);
    panel.hidden = !open;
    button.setAttribute("aria-expanded", String(open));
    try {
      if (open && !filled.has(name)) filled.set(name, PANELS[name]?.(panel, app));
      await filled.get(name);
    } catch {
      filled.delete(name);
      return showNotice(root, page.unloaded);
    }
    panel.dispatchEvent(new Event(panel.hidden ? "close" : "open"));
  };
  /** @param {HTMLButtonElement} button */
  const isOpen = (button) => button.getAttribute("aria-expanded") === "true";
  for (const button of buttons) {
    button.onclick = () => {
      const open = !isOpen(button);
      if (open && narrow.matches) for (const other of buttons) show(other, false);
      show(button, open);
    };
  }
  addEventListener("keydown", ({ code, target, ctrlKey, altKey, metaKey }) => {
    if (ctrlKey || altKey || metaKey) return;
    if (code === "Backquote") find(root, "[aria-controls=details]").click();
    if (code !== "Escape") return;
    for (const button of buttons) {
      if (!isOpen(button)) continue;
      const panel = find(root, `#${button.getAttribute("aria-controls")}`);
      if (panel.contains(target)) button.focus();
      show(button, false);
    }
  });
}

/**
 * Attaches the interface to the page; returns the controls, which are read in each frame.
 * @param {App} app
 */
export function attachUi(app) {
  attachErrors(document, app);
  attachLoading(document, app);
  attachAddress(document, app);
  attachPanels(document, app);
  return attachControls(document, app);
}
