// The decoder of buffer views that are compressed with meshopt (EXT_meshopt_compression), as the cells of
// ptmtools use it: attributes of version 0, with the filter EXPONENTIAL or none, and triangles. It is part of
// the module of the textures (c/meshopt.c) and runs in this thread: 100,000 vertices take a millisecond.

import { compileModule, KEPT, NO_MEMORY } from "./engine.js";
import { PtmError } from "./errors.js";

/**
 * The exports of the module; numbers are addresses unless stated otherwise.
 * @typedef {object} Exports
 * @property {WebAssembly.Memory} memory
 * @property {(length: number, size: number) => number} reserve_view whether memory suffices
 * @property {() => number} data
 * @property {() => number} texels the elements
 * @property {(count: number, stride: number, exponential: number) => number} attributes 0, or an error
 * @property {(count: number, vertices: number) => number} triangles 0, or an error
 */

/**
 * Loads the decoder; `source` and errors are those of `loadEngine`.
 * @param {import("./engine.js").ModuleSource} [source]
 */
export async function loadViewDecoder(source) {
  return new ViewDecoder(await compileModule(source));
}

export class ViewDecoder {
  /** @type {Exports | null} */
  #instance = null;
  #module;

  /** @param {WebAssembly.Module} module */
  constructor(module) {
    this.#module = module;
  }

  /**
   * Elements of `stride` bytes, of mode ATTRIBUTES. Throws an Error if the data are damaged, and
   * PtmError PTM-L103 without memory.
   * @param {Uint8Array} data
   * @param {number} count
   * @param {number} stride a multiple of 4, at most 256
   * @param {boolean} exponential whether the filter is EXPONENTIAL
   */
  attributes(data, count, stride, exponential) {
    if (!(stride > 0 && stride <= 256 && stride % 4 === 0)) throw new Error(`has a stride of ${stride}`);
    return this.#decode(data, count * stride, (coder) => coder.attributes(count, stride, exponential ? 1 : 0));
  }

  /**
   * Indices of 32 bits, all below `vertices`, of mode TRIANGLES. Throws as `attributes`.
   * @param {Uint8Array} data
   * @param {number} count
   * @param {number} vertices
   */
  triangles(data, count, vertices) {
    const bytes = this.#decode(data, 4 * count, (coder) => coder.triangles(count, vertices));
    return new Uint32Array(bytes.buffer);
  }

  /**
   * @param {Uint8Array} data
   * @param {number} size of the elements, bytes
   * @param {(coder: Exports) => number} decode
   */
  #decode(data, size, decode) {
    // A byte of data holds 4 groups of 16 equal bytes at most.
    if (!(size >= 0 && size <= 64 * data.length)) throw new Error("has too few bytes");
    const coder = (this.#instance ??= /** @type {Exports} */ (
      /** @type {unknown} */ (new WebAssembly.Instance(this.#module).exports)
    ));
    const { memory } = coder;
    try {
      const reserved = coder.reserve_view(data.length, size);
      if (!reserved) throw new PtmError("PTM-L103", "decoding needs more memory than is available");
      new Uint8Array(memory.buffer).set(data, coder.data());
      const result = decode(coder);
      if (result === NO_MEMORY) throw new PtmError("PTM-L103", "decoding needs more memory");
      if (result) throw new Error("has damaged geometry");
      return new Uint8Array(memory.buffer).slice(coder.texels(), coder.texels() + size);
    } finally {
      if (memory.buffer.byteLength > KEPT) this.#instance = null;
    }
  }
}
