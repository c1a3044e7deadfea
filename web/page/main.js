// The entry of the page: reads the index, creates the application and runs its frames.

import { hasSimd, loadViewDecoder } from "../ptm/src/index.js";
import { Workers } from "../ptm/src/workers.js";
import { App } from "./app.js";
import { readConfig, Site } from "./data/site.js";
import { contextOf } from "./gl/context.js";
import { loadEmbedding, loadSets, loadTour } from "./load-later.js";
import { PageError } from "./net/errors.js";
import { clock, Fetcher } from "./net/fetcher.js";
import { Opening } from "./net/opening.js";
import { loadPolicy } from "./policy/policies.js";
import { attachUi } from "./ui/all.js";
import { showError } from "./ui/errors.js";
import { page } from "./words/english.js";
import { speak } from "./words/language.js";

/** The site of the page. @param {import("./data/site.js").SiteConfig} config */
async function siteOf(config) {
  const address = new URL(config.index, location.href).href;
  return new Fetcher(() => {}).whole(
    address,
    (body) => new Site(JSON.parse(new TextDecoder().decode(body)), address),
  );
}

/**
 * Decoders of textures and of geometry, which start while the index is on its way.
 * @param {import("./data/site.js").SiteConfig} config
 */
function decodersOf(config) {
  const worker = new URL(config.worker, location.href);
  const address = new URL(config.wasm, location.href).href;
  const compiled = async () =>
    WebAssembly.compile(await new Fetcher(() => {}).whole(address, (body) => body));
  const create = () => new Worker(worker, { type: "module" }), wasm = compiled();
  const geometry = wasm.then(loadViewDecoder);
  geometry.catch(() => {}); // the first cell reports it
  return { workers: new Workers({ wasm, create }), geometry: () => geometry };
}

async function main() {
  const canvas = /** @type {HTMLCanvasElement} */ (document.querySelector("canvas"));
  const config = readConfig();
  try {
    const speaking = speak();
    if (!hasSimd()) {
      await speaking;
      throw new PageError("PTM-V102", page.noSimd);
    }
    const decoders = decodersOf(config), site = siteOf(config);
    // The page knows whether there is one for its address, and whether that leads to its view.
    const preload = /** @type {HTMLLinkElement & {view: number} | null} */ (document.querySelector("#opening[rel=preload]"));
    const opening = preload && new Opening(preload.href, preload.view >= 0);
    const query = new URLSearchParams(location.search), low = query.get("quality") === "low";
    const gl = contextOf(canvas, low);
    await speaking;
    if (!gl) throw new PageError("PTM-V101", page.noWebgl);
    const policy = query.get("policy") ?? "best";
    const known = await loadPolicy(policy).catch(() => false);
    const options = { opening, policy: known ? policy : "best", low };
    const form = query.get("form") === "gpuii" && await loadSets();
    const attach = form && await form.setsOf(await site, gl, options, new Fetcher(() => {}));
    const app = new App(canvas, gl, await site, config, decoders, options);
    if (attach) attach(app.walk);
    Object.assign(window, { ptm: app });
    if (parent !== window || query.has("ui")) loadEmbedding().then((s) => s.attachEmbedding(app), () => {});
    const { tour } = config;
    if (tour) app.on("first-picture", async () => (app.tour = await loadTour().then((s) => s.attachTour(app, tour), () => null)));
    const controls = attachUi(app);
    let before = clock();
    const frame = () => {
      const now = clock();
      try {
        app.frame(now - before, controls.wishes());
      } catch (fault) {
        app.freeze(true);
        end(fault);
        throw fault;
      }
      before = now;
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  } catch (fault) {
    end(fault);
  }
}

/** @param {unknown} fault */
function end(fault) {
  const known = fault instanceof PageError;
  showError(document, known ? fault : new PageError("PTM-V107", String(fault)));
}

main();
