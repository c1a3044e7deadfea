// Decoders in Workers: bytes go there as copies, texels come back in transferred buffers.

import { PtmError } from "./errors.js";

/** @typedef {import("./level-decoder.js").Image} Image */
/** @typedef {import("./level-decoder.js").DecoderOptions} DecoderOptions */
/** @typedef {import("./engine.js").ModuleSource} ModuleSource */
/** @typedef {import("./preview.js").PreviewOptions} PreviewOptions */

/**
 * @typedef {object} WorkersOptions
 * @property {number} [count] of workers; one less than there are processors, 1 to 4
 * @property {ModuleSource | Promise<ModuleSource>} [wasm] where `decoder.wasm` is, if elsewhere, or
 *   a promise of it while the workers start
 * @property {() => import("./serve.js").Port} [create] creates a worker
 */

/** Bytes on their way through a worker. */
export class Task {
  /** @param {{bytes: Uint8Array, decoder: number} | {bytes: Uint8Array, ends: number[], levels: number,
   *   options: DecoderOptions} | {bytes: Uint8Array, preview: PreviewOptions}} order */
  constructor(order) {
    this.order = order;
    /** @type {(images: Image[]) => void} */
    this.resolve = () => {};
    /** @type {(error: unknown) => void} */
    this.reject = () => {};
    /** @type {Promise<Image[]>} */
    this.images = new Promise((resolve, reject) => {
      this.resolve = resolve;
      this.reject = reject;
    });
    // The caller may have left.
    this.images.catch(() => {});
  }
}

/** One worker. It receives one task at a time, so that waiting tasks can be cancelled. */
class Lane {
  /** @type {Task[]} */
  #waiting = [];
  /** @type {Task | undefined} */
  #task;

  /**
   * @param {import("./serve.js").Port} port
   * @param {WorkersOptions["wasm"]} wasm
   */
  constructor(port, wasm) {
    this.port = port;
    // A worker without a module fetches it by itself.
    this.ready = Promise.resolve(wasm).then(
      (wasm) => port.postMessage({ wasm }, []),
      () => {},
    );
    this.decoders = 0;
    /** @type {Error | undefined} */
    this.failure = undefined;
    /** Why it cannot decode files; images it can. @type {Error | undefined} */
    this.useless = undefined;
    port.onmessage = ({ data }) => this.#answered(data);
    port.onerror = (event) => this.fail(new Error(`a worker failed: ${event.message ?? event}`));
  }

  /**
   * Sends an order after the module.
   * @param {import("./serve.js").Order} order
   * @param {Transferable[]} [transfer]
   */
  send(order, transfer = []) {
    this.ready.then(() => this.port.postMessage(order, transfer));
  }

  /** @param {Task} task */
  add(task) {
    const reason = this.failure ?? ("preview" in task.order ? undefined : this.useless);
    if (reason) return task.reject(reason);
    this.#waiting.push(task);
    this.#next();
  }

  /**
   * Cancels a task; returns whether it had not begun.
   * @param {Task} task
   */
  callOff(task) {
    const place = this.#waiting.indexOf(task);
    if (place >= 0) this.#waiting.splice(place, 1);
    return place >= 0;
  }

  /** Marks the worker as failed and rejects its tasks. @param {Error} error */
  fail(error) {
    this.failure = error;
    for (const task of [this.#task, ...this.#waiting]) task?.reject(error);
    this.#task = undefined;
    this.#waiting = [];
  }

  #next() {
    if (this.#task) return;
    this.#task = this.#waiting.shift();
    if (!this.#task) return;
    const { order } = this.#task, bytes = order.bytes.slice();
    this.send({ ...order, bytes }, [bytes.buffer]);
  }

  /** @param {import("./serve.js").Answer} answer */
  #answered({ images, fault, useless }) {
    const task = this.#task;
    this.#task = undefined;
    if (fault) {
      const { code, message } = fault;
      const error = code ? new PtmError(code, message.slice(code.length + 2)) : new Error(message);
      task?.reject(Object.assign(error, { decoded: images.length }));
      if (useless) {
        this.useless = error;
        for (const waiting of this.#waiting.splice(0)) this.add(waiting);
      }
    } else {
      task?.resolve(images);
    }
    this.#next();
  }
}

/** Workers that share the decoding of many files, each in one go. */
export class Workers {
  /** @param {WorkersOptions} [options] */
  constructor({ count, wasm, create } = {}) {
    const processors = globalThis.navigator?.hardwareConcurrency ?? 2;
    const url = new URL("./worker.js", import.meta.url);
    const make = create ?? (() => new Worker(url, { type: "module" }));
    count ??= Math.min(Math.max(processors - 1, 1), 4);
    this.lanes = Array.from({ length: count }, () => new Lane(make(), wasm));
  }

  /** Whether all workers have ended, or never started. */
  get ended() {
    return this.lanes.every(({ failure }) => failure);
  }

  /** Whether no worker can decode files. */
  get failed() {
    return this.lanes.every(({ failure, useless }) => failure ?? useless);
  }

  /**
   * The first levels of a file in one go, so that a busy main thread is waited for once. The bytes are
   * copied. Throws PtmError as `LevelDecoder.refine` and `readHeader`, with the number of levels that
   * were `decoded`; PTM-I105 if the file's levels do not end at `ends`.
   * @param {Uint8Array} bytes of the file from its begin on
   * @param {{ends: number[], levels: number} & DecoderOptions} options where each level ends in the
   *   file, and how many are wanted
   */
  decodeFirst(bytes, { ends, levels, ...options }) {
    return this.#carryOut(new Task({ bytes, ends, levels, options }));
  }

  /**
   * The first levels of an image, as `decodePreview`, in browsers with OffscreenCanvas.
   * @param {Uint8Array} bytes
   * @param {PreviewOptions} preview
   */
  decodePreview(bytes, preview) {
    return this.#carryOut(new Task({ bytes, preview }));
  }

  /** @param {Task} task */
  async #carryOut(task) {
    const lane = this.lane();
    lane.decoders++;
    lane.add(task);
    return task.images.finally(() => lane.decoders--);
  }

  /** The worker that has the fewest decoders, of those that have not failed. */
  lane() {
    const able = this.lanes.filter(({ failure, useless }) => !failure && !useless);
    return (able.length ? able : this.lanes).reduce(
      (one, other) => (other.decoders < one.decoders ? other : one),
    );
  }

  /** Ends all workers at once; tasks under way are rejected. */
  close() {
    for (const { port } of this.lanes) (port.terminate ?? port.close)?.call(port);
    for (const lane of this.lanes) lane.fail(new Error("the workers were closed"));
  }
}
