// Shared by the pages of single objects: settings, the drawing context, frames, errors, the status line.

import { contextOf } from "../gl/context.js";
import { PageError } from "../net/errors.js";
import { clock, Fetcher } from "../net/fetcher.js";
import { find } from "../ui/elements.js";
import { showError, showNotice } from "../ui/errors.js";
import { Track } from "./track.js";
import { form, objects, page } from "../words/english.js";
import { speak } from "../words/language.js";

/** Seconds until a lost context must be back, and that a page shows before it is loaded anew for another loss. */
const BACK = 15, STEADY = 5;

/**
 * @typedef {object} FormConfig
 * @property {string} title
 * @property {string} index URL of the index, relative to the page
 *
 * @typedef {object} View
 * @property {(dt: number) => string} frame draws, and returns the status line
 * @property {() => object} state for tests and users of the console
 * @property {() => string} [address] the fragment that leads back to the present view
 * @property {() => import("./track.js").Look} [look] of a view that can be recorded: `record()` begins, and
 *   `recording` is the walk so far, or null
 */

/**
 * Runs a page: `create` makes its view, `window.ptm`.
 * @param {(gl: WebGL2RenderingContext, config: FormConfig, fetcher: Fetcher, fail: (fault: unknown) => void)
 *   => Promise<View>} create
 */
export async function runForm(create) {
  let failed = false, lost = false;
  /** @param {unknown} fault */
  const fail = (fault) => {
    failed = true;
    const known = fault instanceof PageError;
    showError(document, known ? fault : new PageError("PTM-V107", String(fault)));
  };
  try {
    await speak({ page, form, objects });
    const canvas = /** @type {HTMLCanvasElement} */ (find(document, "canvas"));
    const config = JSON.parse(find(document, "#site").textContent ?? "");
    const gl = contextOf(canvas);
    if (!gl) throw new PageError("PTM-V101", page.noWebgl);
    /** @type {View | null} */
    let view = null;
    const begun = clock();
    canvas.addEventListener("webglcontextlost", (event) => {
      event.preventDefault();
      lost = true;
      const end = () => fail(new PageError("PTM-V107", form.reset));
      // A card that cannot hold the view would lose it again and again.
      if (clock() - begun < STEADY) end();
      else setTimeout(end, 1000 * BACK);
    });
    // Files are in the browser's cache, so loading anew restores the view soon.
    canvas.addEventListener("webglcontextrestored", () => {
      if (failed) return;
      if (view?.address) history.replaceState(null, "", view.address());
      location.reload();
    });
    const fetcher = new Fetcher((message) => showNotice(document, message));
    // What fails without a context is no fault.
    view = await create(gl, config, fetcher, (fault) => {
      if (!lost) fail(fault);
    });
    const shown = view, { look } = view;
    /** @type {Track | null} */
    let track = null;
    if (look) {
      Object.defineProperties(view, {
        record: { value: () => (track = new Track(canvas, look)) },
        recording: { get: () => track?.document ?? null },
      });
    }
    Object.assign(window, { ptm: view });
    const status = find(document, "#status");
    let before = clock();
    const frame = () => {
      if (failed || lost) return;
      const now = clock();
      try {
        fit(canvas);
        const line = shown.frame(Math.min(now - before, 0.1));
        track?.frame();
        if (status.textContent !== line) status.textContent = line;
      } catch (fault) {
        fail(fault);
        throw fault;
      }
      before = now;
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
    document.body.classList.add("begun");
    // The canvas has the focus from the begin; only visitors with keys need to see it.
    addEventListener("keydown", () => document.body.classList.add("keys"), { once: true });
  } catch (fault) {
    fail(fault);
  }
}

/** One pixel of the canvas is one of the screen. @param {HTMLCanvasElement} canvas */
function fit(canvas) {
  const width = Math.max(1, Math.round(canvas.clientWidth * devicePixelRatio));
  const height = Math.max(1, Math.round(canvas.clientHeight * devicePixelRatio));
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
}

/**
 * The index of a form.
 * @template T
 * @param {Fetcher} fetcher
 * @param {string} url
 * @param {(index: any) => T} check returns what the page needs of it, or throws
 */
export function indexOf(fetcher, url, check) {
  return fetcher.whole(url, (body) => check(JSON.parse(new TextDecoder("utf-8", { fatal: true }).decode(body))));
}
