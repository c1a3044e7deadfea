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
 *   | {decoder: number, groups: Uint8Array[]}
 *   | {decoder: number}} Order
 */

/**
 * What it answers when it has refined: the levels that were decoded, and what is wrong with the next.
 * @typedef {object} Answer
 * @property {import("./level-decoder.js").Image[]} images
 * @property {string} engine its name, "" if there was none
 * @property {{code: string | null, message: string} | null} fault
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
    } else if ("groups" in order) {
      const decoder = /** @type {LevelDecoder} */ (decoders.get(order.decoder));
      const images = [];
      let fault = null;
      try {
        for (const group of order.groups) images.push(decoder.refine(group));
      } catch (error) {
        fault = faultOf(error);
      }
      const answer = { images, engine: engine.name, fault };
      port.postMessage(answer, images.map(({ data }) => data.buffer));
    } else {
      decoders.delete(order.decoder);
    }
  }

  port.onmessage = ({ data: order }) => {
    before = before.then(() =>
      obey(order).catch((error) => {
        port.postMessage({ images: [], engine: "", fault: faultOf(error) }, []);
      }),
    );
  };
}

/** @param {any} error */
function faultOf(error) {
  const code = error instanceof PtmError ? error.code : null;
  return { code, message: String(error?.message ?? error) };
}
