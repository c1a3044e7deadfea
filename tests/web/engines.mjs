// The engines of the decoder, by name.

import { readFileSync } from "node:fs";

const module = new URL("../../web/ptm/decoder.wasm", import.meta.url);

/** @param {string} name "js" or "wasm" */
export async function makeEngine(name) {
  if (name === "js") return (await import("../../web/ptm/src/js/engine.js")).plainEngine;
  const { wasmEngine } = await import("../../web/ptm/src/wasm-engine.js");
  return wasmEngine(await WebAssembly.compile(readFileSync(module)));
}
