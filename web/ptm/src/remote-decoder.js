// Decoders in Workers that decode a level at a time, beside what these decode in one go.

import { Task, Workers } from "./workers.js";

/** @typedef {import("./container.js").Header} Header */
/** @typedef {import("./level-decoder.js").Image} Image */
/** @typedef {import("./level-decoder.js").DecoderOptions} DecoderOptions */

/** As `LevelDecoder`, in a worker. */
class RemoteDecoder {
  /** @type {Task | undefined} */
  #task;
  #asked = false;

  /**
   * @param {ReturnType<Workers["lane"]>} lane
   * @param {number} number
   */
  constructor(lane, number) {
    this.lane = lane;
    this.number = number;
    /** The level decoded last, -1 at first. */
    this.level = -1;
  }

  /**
   * The next level from its group, as `LevelDecoder.refine`; one at a time. A level aborted while
   * a worker decodes it is not lost: the next call returns it, whatever bytes it is given.
   * @param {Uint8Array} data all bytes of the group
   * @param {{signal?: AbortSignal}} [options] rejects with the signal's reason
   * @returns {Promise<Image>}
   */
  async refine(data, { signal } = {}) {
    signal?.throwIfAborted();
    if (this.#asked) throw new Error("a level is being decoded already");
    this.#asked = true;
    let task = this.#task;
    if (!task) {
      task = this.#task = new Task({ decoder: this.number, bytes: data });
      this.lane.add(task);
    }
    try {
      const [image] = await unlessAborted(task.images, signal);
      this.level = image.level;
      this.#task = undefined;
      return image;
    } catch (error) {
      if (!signal?.aborted || this.lane.callOff(task)) this.#task = undefined;
      throw error;
    } finally {
      this.#asked = false;
    }
  }

  /** Ends the decoder and frees its memory in the worker. */
  close() {
    if (this.#task) this.lane.callOff(this.#task);
    this.lane.decoders--;
    this.lane.send({ decoder: this.number });
  }
}

/** Workers that share the decoding of many files. */
export class DecoderWorkers extends Workers {
  #decoders = 0;

  /**
   * A decoder of a file, in the worker that has the fewest, of those that have not failed.
   * @param {Header} header
   * @param {DecoderOptions} [options]
   */
  decoder(header, options = {}) {
    const lane = this.lane();
    lane.decoders++;
    const number = this.#decoders++;
    lane.send({ decoder: number, header, options });
    return new RemoteDecoder(lane, number);
  }
}

/**
 * @template T
 * @param {Promise<T>} promise
 * @param {AbortSignal} [signal]
 * @returns {Promise<T>}
 */
function unlessAborted(promise, signal) {
  if (!signal) return promise;
  return new Promise((resolve, reject) => {
    const stop = () => reject(signal.reason);
    signal.addEventListener("abort", stop, { once: true });
    promise.then(resolve, reject).finally(() => signal.removeEventListener("abort", stop));
  });
}
