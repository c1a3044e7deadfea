// The worker's side: decoders by number, each told what to do next.

import { PtmError } from "./errors.js";
import { LevelDecoder } from "./level-decoder.js";
import { loadEngine } from "./load-engine.js";

/**
 * What a worker is told: where the module is, first of all; then of a decoder that it begins, that it
 * refines, that it ends.
 * @typedef {{wasm?: import("./load-engine.js").ModuleSource}
 *   | {decoder: number, header: import("./container.js").Header,
 *      options: import("./level-decoder.js").DecoderOptions}
 *   | {decoder: number, data: Uint8Array}
 *   | {decoder: number}} Order
 */

/**
 * What it answers to each group of bytes, in order.
 * @typedef {{image: import("./level-decoder.js").Image, engine: string}
 *   | {code: string | null, message: string}} Answer
 */

/**
 * What both sides talk through: a Worker, the inside of one, or a MessagePort.
 * @typedef {object} Port
 * @property {(message: any, transfer: Transferable[]) => void} postMessage
 * @property {((event: any) => void) | null} onmessage
 * @property {((event: any) => void) | null} [onerror]
 * @property {() => void} [terminate]
 * @property {() => void} [close]
 */

/** @param {Port} port */
export function serve(port) {
  /** @type {Map<number, LevelDecoder>} */
  const decoders = new Map();
  /** @type {Promise<import("./level-decoder.js").Engine> | undefined} */
  let loading;
  // One order after the other: the first ones wait for the engine.
  let before = Promise.resolve();

  /** @param {Order} order */
  async function obey(order) {
    if (!("decoder" in order)) {
      loading = loadEngine(order.wasm);
      return;
    }
    const engine = await (loading ??= loadEngine());
    if ("header" in order) {
      decoders.set(order.decoder, new LevelDecoder(order.header, engine, order.options));
    } else if ("data" in order) {
      const decoder = /** @type {LevelDecoder} */ (decoders.get(order.decoder));
      const image = decoder.refine(order.data);
      port.postMessage({ image, engine: engine.name }, [image.data.buffer]);
    } else {
      decoders.delete(order.decoder);
    }
  }

  port.onmessage = ({ data: order }) => {
    before = before.then(() =>
      obey(order).catch((error) => {
        const code = error instanceof PtmError ? error.code : null;
        port.postMessage({ code, message: String(error?.message ?? error) }, []);
      }),
    );
  };
}
