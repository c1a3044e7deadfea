// The engine in WebAssembly with SIMD (c/*.c). A tile at a time goes into its memory and comes out.

import { PtmError, damaged } from "./errors.js";
import { geometricTables, tokenTables } from "./families.js";

/** @typedef {import("./texels.js").Shape} Shape */

/**
 * What the module exports; numbers are addresses unless said otherwise.
 * @typedef {object} Exports
 * @property {WebAssembly.Memory} memory
 * @property {() => number} geometric_tables
 * @property {() => number} token_tables
 * @property {(length: number, width: number, height: number, components: number) => number} reserve
 *   whether there is room
 * @property {() => number} data
 * @property {() => number} below
 * @property {() => number} texels
 * @property {() => number} haar 0, or what is wrong; as the next two
 * @property {() => number} repeats
 * @property {(error: number) => number} texel
 */

/** Results of the coders. */
const NO_MEMORY = 2;
/** Memory never shrinks: an instance that has grown beyond this is given up after the tile. */
const KEPT = 2 ** 25;

/**
 * @param {WebAssembly.Module} module
 * @returns {import("./level-decoder.js").Engine}
 */
export function wasmEngine(module) {
  /** @type {Exports | null} */
  let instance = null;

  function instantiate() {
    const exports = /** @type {unknown} */ (new WebAssembly.Instance(module).exports);
    const made = /** @type {Exports} */ (exports);
    const { buffer } = made.memory;
    new Uint16Array(buffer).set(geometricTables(), made.geometric_tables() / 2);
    return made;
  }

  /**
   * @param {(exports: Exports) => number} coder
   * @param {Uint8Array} data
   * @param {Uint32Array} below
   * @param {Shape} shape
   */
  function decode(coder, data, below, { width, height, components }) {
    const used = (instance ??= instantiate());
    try {
      if (!used.reserve(data.length, width, height, components)) throw noMemory();
      new Uint8Array(used.memory.buffer).set(data, used.data());
      new Uint32Array(used.memory.buffer).set(below, used.below() / 4);
      const result = coder(used);
      if (result === NO_MEMORY) throw noMemory();
      if (result) throw damaged("no encoder writes such bytes");
      return new Uint32Array(used.memory.buffer, used.texels(), width * height);
    } finally {
      if (used.memory.buffer.byteLength > KEPT) instance = null;
    }
  }

  return {
    name: "wasm",
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
  return new PtmError("PTM-L103", "there is not as much memory as decoding takes");
}
