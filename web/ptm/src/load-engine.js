// Which engine decodes: WebAssembly with SIMD, or plain JavaScript where there is none.

import { wasmEngine } from "./wasm-engine.js";

/**
 * Where `decoder.wasm` is: its address, its bytes, or what was made of them.
 * @typedef {URL | string | BufferSource | WebAssembly.Module} ModuleSource
 */

/** Where it is in this package. */
export const DECODER_URL = new URL("../decoder.wasm", import.meta.url);

/**
 * The fastest engine that runs here; its `name`, "wasm" or "js", tells which. What cannot be fetched
 * or compiled (no WebAssembly, no SIMD, a policy that forbids it) is done without.
 * @param {ModuleSource} [source]
 * @returns {Promise<import("./level-decoder.js").Engine>}
 */
export async function loadEngine(source = DECODER_URL) {
  try {
    return wasmEngine(await compiled(source));
  } catch {
    return (await import("./js/engine.js")).plainEngine;
  }
}

/** @param {ModuleSource} source */
async function compiled(source) {
  if (source instanceof WebAssembly.Module) return source;
  if (typeof source !== "string" && !(source instanceof URL)) return WebAssembly.compile(source);
  const response = await fetch(source);
  if (!response.ok) throw new Error(`${source}: ${response.status}`);
  return WebAssembly.compile(await response.arrayBuffer());
}
