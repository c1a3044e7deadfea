// Shared by the pages of single objects: settings, the drawing context, frames, errors, the status line.

import { PageError } from "../net/errors.js";
import { clock, Fetcher } from "../net/fetcher.js";
import { find } from "../ui/elements.js";
import { showError, showNotice } from "../ui/errors.js";

/**
 * @typedef {object} FormConfig
 * @property {string} title
 * @property {string} index URL of the index, relative to the page
 *
 * @typedef {object} View
 * @property {(dt: number) => string} frame draws, and returns the status line
 * @property {() => object} state for tests and users of the console
 */

/**
 * Runs a page: `create` makes its view, `window.ptm`.
 * @param {(gl: WebGL2RenderingContext, config: FormConfig, fetcher: Fetcher, fail: (fault: unknown) => void)
 *   => Promise<View>} create
 */
export async function runForm(create) {
  let failed = false;
  /** @param {unknown} fault */
  const fail = (fault) => {
    failed = true;
    const known = fault instanceof PageError;
    showError(document, known ? fault : new PageError("PTM-V107", String(fault)));
  };
  try {
    const canvas = /** @type {HTMLCanvasElement} */ (find(document, "canvas"));
    const config = JSON.parse(find(document, "#site").textContent ?? "");
    const gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: false });
    if (!gl) throw new PageError("PTM-V101", "This browser cannot draw with WebGL 2.");
    canvas.addEventListener("webglcontextlost", (event) => {
      event.preventDefault();
      fail(new PageError("PTM-V107", "The graphics card has reset the page."));
    });
    const fetcher = new Fetcher((message) => showNotice(document, message));
    const view = await create(gl, config, fetcher, fail);
    Object.assign(window, { ptm: view });
    const status = find(document, "#status");
    let before = clock();
    const frame = () => {
      if (failed) return;
      const now = clock();
      try {
        fit(canvas);
        const line = view.frame(Math.min(now - before, 0.1));
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
