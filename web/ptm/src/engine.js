// The coders of profile `fast`: WebAssembly with SIMD (c/*.c), instantiated in this thread. A tile at a
// time is copied into its memory and out of it.

import { PtmError, damaged } from "./errors.js";
import { geometricTables, tokenTables } from "./families.js";

/** @typedef {import("./texels.js").Shape} Shape */

/**
 * The source of `decoder.wasm`: its URL, its bytes, or the compiled module.
 * @typedef {URL | string | BufferSource | WebAssembly.Module} ModuleSource
 */

/**
 * Decodes one tile of `fast` from its bytes (behind those that name its coder) and the same part of the
 * level below. The next call may overwrite the texels that it returns.
 * @typedef {object} Engine
 * @property {(bytes: Uint8Array) => number} crc32 of PNG and zip, unsigned
 * @property {(data: Uint8Array, below: Uint32Array, shape: Shape) => Uint32Array} haar
 * @property {(data: Uint8Array, below: Uint32Array, shape: Shape) => Uint32Array} repeats
 * @property {(data: Uint8Array, below: Uint32Array, shape: Shape, error: number) => Uint32Array} texel
 */

/**
 * The exports of the module; numbers are addresses unless stated otherwise.
 * @typedef {object} Exports
 * @property {WebAssembly.Memory} memory
 * @property {() => number} geometric_tables
 * @property {() => number} token_tables
 * @property {(length: number) => number} reserve_bytes 0 if memory does not suffice
 * @property {(bytes: number, length: number) => number} checksum
 * @property {(length: number, width: number, height: number, components: number) => number} reserve
 *   whether memory suffices
 * @property {() => number} data
 * @property {() => number} below
 * @property {() => number} texels
 * @property {() => number} haar 0, or an error; as the next two
 * @property {() => number} repeats
 * @property {(error: number) => number} texel
 */

/** The module of this package. */
export const DECODER_URL = /* @__PURE__ */ new URL("./decoder.wasm", import.meta.url);
/** An error of the coders. */
export const NO_MEMORY = 2;
/** Memory never shrinks: an instance that has grown beyond this is given up after the tile. */
export const KEPT = 2 ** 25;

/** A module that declares a function type with a vector of 128 bits, and nothing else. */
const VECTOR_TYPE = /* @__PURE__ */ Uint8Array.of(0, 97, 115, 109, 1, 0, 0, 0, 1, 5, 1, 96, 0, 1, 123);

/** Whether this browser runs WebAssembly with SIMD. */
export function hasSimd() {
  return typeof WebAssembly === "object" && WebAssembly.validate(VECTOR_TYPE);
}

/**
 * Compiles the module. Throws PtmError PTM-M103 in a browser without SIMD in WebAssembly; any other
 * Error if the module cannot be fetched or is damaged, or if a security policy forbids it.
 * @param {ModuleSource} [source]
 * @returns {Promise<Engine>}
 */
export async function loadEngine(source) {
  return engineOf(await compileModule(source));
}

/**
 * Compiles the module; throws as `loadEngine`.
 * @param {ModuleSource} [source]
 * @returns {Promise<WebAssembly.Module>}
 */
export async function compileModule(source = DECODER_URL) {
  if (!hasSimd()) throw new PtmError("PTM-M103", "this browser has no SIMD in WebAssembly");
  if (source instanceof WebAssembly.Module) return source;
  if (typeof source !== "string" && !(source instanceof URL)) return WebAssembly.compile(source);
  const response = await fetch(source);
  if (!response.ok) throw new Error(`${source}: ${response.status}`);
  return WebAssembly.compile(await response.arrayBuffer());
}

/**
 * @param {WebAssembly.Module} module
 * @returns {Engine}
 */
function engineOf(module) {
  /** @type {Exports | null} */
  let instance = null;

  function instantiate() {
    const { exports } = /** @type {{exports: any}} */ (new WebAssembly.Instance(module));
    const coders = /** @type {Exports} */ (exports);
    new Uint16Array(coders.memory.buffer).set(geometricTables(), coders.geometric_tables() / 2);
    return coders;
  }

  /** @param {Uint8Array} bytes */
  function crc32(bytes) {
    const { memory, reserve_bytes: reserve, checksum } = (instance ??= instantiate());
    const at = reserve(bytes.length);
    if (!at) throw noMemory();
    new Uint8Array(memory.buffer).set(bytes, at);
    return checksum(at, bytes.length) >>> 0;
  }

  /**
   * @param {(exports: Exports) => number} coder
   * @param {Uint8Array} data
   * @param {Uint32Array} below
   * @param {Shape} shape
   */
  function decode(coder, data, below, { width, height, components }) {
    const coders = (instance ??= instantiate());
    const { memory } = coders;
    try {
      if (!coders.reserve(data.length, width, height, components)) throw noMemory();
      new Uint8Array(memory.buffer).set(data, coders.data());
      new Uint32Array(memory.buffer).set(below, coders.below() / 4);
      const result = coder(coders);
      if (result === NO_MEMORY) throw noMemory();
      if (result) throw damaged("no encoder writes such bytes");
      return new Uint32Array(memory.buffer, coders.texels(), width * height);
    } finally {
      if (memory.buffer.byteLength > KEPT) instance = null;
    }
  }

  return {
    crc32,
    haar: (data, below, shape) => decode((coders) => coders.haar(), data, below, shape),
    repeats: (data, below, shape) => decode((coders) => coders.repeats(), data, below, shape),
    texel: (data, below, shape, error) =>
      decode(
        (coders) => {
          new Uint16Array(coders.memory.buffer).set(tokenTables(), coders.token_tables() / 2);
          return coders.texel(error);
        },
        data,
        below,
        shape,
      ),
  };
}

function noMemory() {
  return new PtmError("PTM-L103", "decoding needs more memory than is available");
}
