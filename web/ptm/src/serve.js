// The worker's side: decoders by number, and the orders that they carry out.

import { readHeader } from "./container.js";
import { loadEngine } from "./engine.js";
import { PtmError } from "./errors.js";
import { LevelDecoder } from "./level-decoder.js";
import { decodePreview } from "./preview.js";

/**
 * A message to a worker: first the source of the module; then a file or an image whose first levels are
 * wanted; or the begin, a refinement or the end of a decoder.
 * @typedef {{wasm?: import("./engine.js").ModuleSource}
 *   | {bytes: Uint8Array, ends: number[], levels: number,
 *      options: import("./level-decoder.js").DecoderOptions}
 *   | {bytes: Uint8Array<ArrayBuffer>, preview: import("./preview.js").PreviewOptions}
 *   | {decoder: number, header: import("./container.js").Header,
 *      options: import("./level-decoder.js").DecoderOptions}
 *   | {decoder: number, bytes: Uint8Array}
 *   | {decoder: number}} Order
 */

/**
 * The answer to bytes: the decoded levels, and the error of the next.
 * @typedef {object} Answer
 * @property {import("./level-decoder.js").Image[]} images
 * @property {{code: string | null, message: string} | null} fault
 * @property {boolean} [useless] whether the worker has no engine and will never decode anything
 */

/**
 * The channel of both sides: a Worker, its inside, or a MessagePort.
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
  /** @type {Promise<import("./engine.js").Engine> | undefined} */
  let loading;
  // One order after the other: the first ones wait for the engine.
  let before = Promise.resolve();

  /** @param {Order} order */
  async function obey(order) {
    if ("wasm" in order) {
      loading = loadEngine(order.wasm);
      loading.catch(() => {}); // the next order reports it
      return;
    }
    if ("preview" in order) {
      const images = await decodePreview(order.bytes, order.preview);
      port.postMessage({ images, fault: null }, images.map(({ data }) => data.buffer));
      return;
    }
    const engine = await (loading ??= loadEngine()).catch((error) => {
      throw Object.assign(error, { useless: true });
    });
    if ("header" in order) {
      decoders.set(order.decoder, new LevelDecoder(order.header, engine, order.options));
    } else if ("bytes" in order) {
      /** @type {import("./level-decoder.js").Image[]} */
      const images = [];
      let fault = null;
      try {
        if ("ends" in order) for (const image of firstLevels(order, engine)) images.push(image);
        else images.push(/** @type {LevelDecoder} */ (decoders.get(order.decoder)).refine(order.bytes));
      } catch (error) {
        fault = faultOf(error);
      }
      port.postMessage({ images, fault }, images.map(({ data }) => data.buffer));
    } else if ("decoder" in order) {
      decoders.delete(order.decoder);
    }
  }

  port.onmessage = ({ data: order }) => {
    before = before.then(() =>
      obey(order).catch((error) => {
        port.postMessage({ images: [], fault: faultOf(error), useless: error.useless }, []);
      }),
    );
  };
}

/**
 * The first levels of a file. Throws as `readHeader` and `refine` do; PTM-I105 if the ends of its
 * levels differ from the given ones.
 * @param {{bytes: Uint8Array, ends: number[], levels: number,
 *   options: import("./level-decoder.js").DecoderOptions}} order
 * @param {import("./engine.js").Engine} engine
 */
function* firstLevels({ bytes, ends, levels, options }, engine) {
  const header = readHeader(bytes);
  const own = header.levels.map(({ offset, length }) => offset + length);
  if (own.join() !== ends.join()) throw new PtmError("PTM-I105", "its levels end elsewhere");
  const decoder = new LevelDecoder(header, engine, options);
  for (const { offset, length } of header.levels.slice(0, levels)) {
    yield decoder.refine(bytes.subarray(offset, offset + length));
  }
}

/** @param {any} error */
function faultOf(error) {
  const code = error instanceof PtmError ? error.code : null;
  return { code, message: String(error?.message ?? error) };
}
