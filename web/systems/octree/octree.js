// An octree texture that comes by levels: its stream, and its texels on the graphics card
// (docs/formats/apo.md; Lacoste et al., sections 4.1 and 4.2).

import { PageError } from "../../page/net/errors.js";
import { clock } from "../../page/net/fetcher.js";
import { checksum } from "./checksum.js";
import { objects } from "../../page/words/english.js";
import { fill } from "../../page/words/language.js";

/** Texels in a row of the texture, and the most in all. */
export const WIDTH = 4096, MOST = 2 ** 24;
/** Levels of the first request: with fewer, the mesh's own normals are as good. */
const FIRST = 7;
/** Bytes of a request with updates at fixed time steps. */
const PIECE = 1 << 16;
/** An empty final block: it ends a deflate stream after a full flush. */
const END = new Uint8Array([3, 0]);
/** Bytes before the deflate data of a zlib stream, and after it. */
const HEAD = 2, CHECK = 4;

/** @typedef {{file: string, ends: number[], crc32: number[]}} Stream */

/**
 * @typedef {object} OctreeIndex
 * @property {{low: number[], side: number}} cube
 * @property {number[]} levels texels of each
 * @property {Stream[]} streams of normals, and of colours if there are any
 */

/** Throws unless a condition holds. @param {unknown} holds @param {string} what */
export function demand(holds, what) {
  if (!holds) throw new Error(what);
}

/** Whether a value is an integer from `low` to `high`. @param {unknown} value @param {number} low
 * @param {number} high @returns {value is number} */
export const isWhole = (value, low, high) =>
  Number.isInteger(value) && low <= /** @type {number} */ (value) && /** @type {number} */ (value) <= high;

/** Throws for a cube, levels or streams that no octree has. @param {OctreeIndex} index */
export function checkOctree({ cube, levels, streams }) {
  const isNumber = (/** @type {unknown} */ x) => typeof x === "number" && Math.abs(x) <= 1e15;
  demand(Array.isArray(cube?.low) && cube.low.length === 3 && cube.low.every(isNumber), "no cube");
  demand(isNumber(cube.side) && cube.side >= 1e-15, "no cube");
  demand(Array.isArray(levels) && isWhole(levels.length, 1, 21), "no levels");
  demand(levels.every((count) => isWhole(count, 1, MOST)), "a level without texels");
  demand(levels.reduce((sum, count) => sum + count, 0) <= MOST, "too many texels");
  for (const stream of streams) {
    for (const list of [stream?.ends, stream?.crc32]) {
      demand(Array.isArray(list) && list.length === levels.length, "lists of other lengths");
      demand(list.every((value) => isWhole(value, 0, 0xffffffff)), "a list without numbers");
    }
    demand(stream.ends.every((end, k) => end > (k ? stream.ends[k - 1] : HEAD)), "ends that do not ascend");
  }
}

/** Rows that are uploaded at a time: a megabyte. */
const STRIPE = 64;
/** Seconds until levels that could not be downloaded are requested again. */
const REST = 10;

/** The fewest levels that are there after the next request. @param {number} levels that are there
 * @param {number} count in all */
export const followingOf = (levels, count) => (levels ? levels + 1 : Math.min(FIRST, count));

/** Whether an error has a code and a message for visitors; scripts have classes of their own.
 * @param {any} fault */
const isKnown = (fault) => typeof fault?.code === "string" && fault.code.startsWith("PTM-V");

/** The texels of one stream, and on the graphics card. */
class Texels {
  /** Whole rows that were uploaded. */
  rows = 0;

  /** @param {WebGL2RenderingContext} gl @param {number} count */
  constructor(gl, count) {
    this.gl = gl;
    const height = Math.max(1, Math.ceil(count / WIDTH));
    this.size = 4 * WIDTH * height;
    /** In main memory, until all are on the graphics card. @type {Uint8Array | null} */
    this.bytes = new Uint8Array(this.size);
    this.texture = gl.createTexture();
    this.#bound(() => {
      gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA8UI, WIDTH, height);
      for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) {
        gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
      }
    });
  }

  /** Other programs look floats up in units 0 to 2. @param {() => void} call */
  #bound(call) {
    const { gl } = this;
    gl.activeTexture(gl.TEXTURE3);
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    call();
    gl.activeTexture(gl.TEXTURE0);
  }

  /** Uploads rows up to a texel, the last of which again as it fills; whether it was one stripe at most.
   * @param {number} end */
  upload(end) {
    const { gl, bytes, rows } = this;
    if (!bytes) return true;
    const last = Math.ceil(end / WIDTH), to = Math.min(last, rows + STRIPE);
    this.#bound(() => gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, rows, WIDTH, to - rows, gl.RGBA_INTEGER,
      gl.UNSIGNED_BYTE, bytes, 4 * WIDTH * rows));
    this.rows = Math.min(to, Math.floor(end / WIDTH));
    return to === last;
  }
}

export class Octree {
  /** Texels of each stream that are there, of the level on its way, and that are shown. */
  #arrived = [0, 0];
  #shown = 0;
  #deleted = false;
  /** Whole files, from a host that ignores ranges. @type {(Uint8Array | null)[]} */
  #whole = [];

  /**
   * @param {WebGL2RenderingContext} gl
   * @param {OctreeIndex} index
   * @param {(file: string) => string} urlOf
   * @param {import("../../page/net/fetcher.js").Fetcher} fetcher
   * @param {number} step seconds between updates; 0 updates when a level is complete
   */
  constructor(gl, index, urlOf, fetcher, step) {
    this.gl = gl;
    this.index = index;
    this.urlOf = urlOf;
    this.fetcher = fetcher;
    this.step = step;
    /** The texel at which each level begins, and their number. */
    this.starts = [0];
    for (const count of index.levels) this.starts.push((this.starts.at(-1) ?? 0) + count);
    this.count = /** @type {number} */ (this.starts.at(-1));
    if (gl.getParameter(gl.MAX_TEXTURE_SIZE) < WIDTH) {
      throw new PageError("PTM-V101", objects.largeTexture);
    }
    this.streams = index.streams;
    this.texels = this.streams.map(() => new Texels(gl, this.count));
    /** Complete levels, and whether the next one is there in part. */
    this.levels = 0;
    this.partial = false;
    this.updates = 0;
    this.running = false;
    this.restsUntil = 0;
    /** Receives the bytes still to come of the levels on their way. @type {{left: number} | undefined} */
    this.progress = undefined;
  }

  /** Whether all levels are there. */
  get complete() {
    return this.levels === this.index.levels.length;
  }

  delete() {
    this.#deleted = true;
    for (const { texture } of this.texels) this.gl.deleteTexture(texture);
  }

  /** Bytes on the graphics card. */
  get bytes() {
    return this.texels.reduce((sum, { size }) => sum + size, 0);
  }

  /** Whether it waits after an error, or for ever after one that stays. */
  get rests() {
    return clock() < this.restsUntil;
  }

  /** Bytes of the file up to the last complete level. */
  get fetched() {
    return this.levels ? this.streams.reduce((sum, { ends }) => sum + ends[this.levels - 1], 0) : 0;
  }

  /**
   * Fetches the next levels, if none is on its way and they are wanted. After an error the levels before
   * stay.
   * @param {(levels: number) => boolean} wanted whether more than these levels are
   * @param {(fault: PageError) => void} fail
   * @param {() => void} [done] called when they are there
   * @param {number} [end] their number then
   */
  advance(wanted, fail, done, end = followingOf(this.levels, this.index.levels.length)) {
    if (this.running || this.complete || this.rests || !wanted(this.levels)) return;
    this.running = true;
    return this.#next(end).then(() => done?.(), (fault) => {
      this.restsUntil = fault.code === "PTM-V104" ? clock() + REST : Infinity;
      if (!this.#deleted) fail(fault);
    }).finally(() => (this.running = false));
  }

  /** @param {number} end */
  async #next(end) {
    const timer = this.step && this.levels ? setInterval(() => this.#show(), 1000 * this.step) : 0;
    try {
      await Promise.all(this.streams.map((_, k) => this.#fetch(k, this.levels, end)));
    } finally {
      clearInterval(timer);
      this.partial = false;
    }
    for (const texels of this.texels) {
      // A frame for each megabyte.
      while (!this.#deleted && !texels.upload(this.starts[end])) {
        await new Promise((resolve) => setTimeout(resolve, 16));
      }
    }
    if (this.#deleted) return;
    this.updates++;
    this.levels = end;
    if (this.complete) for (const texels of this.texels) texels.bytes = null;
  }

  /** Uploads what has come of a level since the last time. */
  #show() {
    const there = Math.min(...this.#arrived.slice(0, this.streams.length));
    if (this.#deleted || there <= Math.max(this.#shown, this.starts[this.levels])) return;
    for (const texels of this.texels) while (!texels.upload(there));
    this.#shown = there;
    this.updates++;
    this.partial = true;
  }

  /**
   * Fetches and inflates levels `from` to before `to` of a stream; once more if they are damaged.
   * @param {number} number of the stream @param {number} from @param {number} to
   */
  async #fetch(number, from, to) {
    try {
      await this.#attempt(number, from, to, "default");
    } catch (fault) {
      if (isKnown(fault)) throw fault;
      this.#whole[number] = null;
      await this.#attempt(number, from, to, "no-store").catch((again) => {
        if (isKnown(again)) throw again;
        throw new PageError("PTM-V105", fill(objects.damaged, { file: this.streams[number].file, reason: again.message }));
      });
    }
  }

  /** @param {number} number @param {number} from @param {number} to @param {RequestCache} cache */
  async #attempt(number, from, to, cache) {
    const stream = this.streams[number], texels = this.texels[number];
    const bytes = /** @type {Uint8Array} */ (texels.bytes);
    const begin = from ? stream.ends[from - 1] : HEAD;
    const end = stream.ends[to - 1] - (to === stream.ends.length ? CHECK : 0);
    const inflating = new DecompressionStream("deflate-raw"), writer = inflating.writable.getWriter();
    const last = 4 * this.starts[to], crcs = new Map();
    let at = 4 * this.starts[from], level = from;
    // What an earlier attempt has uploaded is uploaded again.
    texels.rows = Math.min(texels.rows, Math.floor(this.starts[from] / WIDTH));
    this.#arrived[number] = this.#shown = this.starts[from];
    const reading = (async () => {
      for (const reader = inflating.readable.getReader(); ; ) {
        const { done, value } = await reader.read();
        if (done) return;
        demand(at + value.length <= last, "more texels than the index says");
        bytes.set(value, at);
        for (let place = 0; place < value.length; ) {
          const rest = 4 * this.starts[level + 1] - at, part = value.subarray(place, place + rest);
          crcs.set(level, checksum(part, crcs.get(level)));
          place += part.length;
          at += part.length;
          if (part.length === rest) level++;
        }
        this.#arrived[number] = Math.floor(at / 4);
      }
    })();
    reading.catch(() => {}); // awaited below
    const piece = this.step && from ? PIECE : end - begin;
    for (let place = begin; place < end; place += piece) {
      const body = await this.#range(number, place, Math.min(place + piece, end), cache);
      await Promise.race([writer.write(/** @type {any} */ (body)), reading]);
    }
    if (to < stream.ends.length) await Promise.race([writer.write(END), reading]);
    await Promise.all([writer.close(), reading]);
    demand(at === last, "fewer texels than the index says");
    for (let k = from; k < to; k++) demand(crcs.get(k) === stream.crc32[k], `level ${k} has another checksum`);
  }

  /** Bytes of a stream's file. @param {number} number @param {number} begin @param {number} end
   * @param {RequestCache} cache */
  async #range(number, begin, end, cache) {
    const { file, ends } = this.streams[number], size = /** @type {number} */ (ends.at(-1));
    let whole = this.#whole[number];
    if (!whole) {
      const answer = await this.fetcher.range(this.urlOf(file), begin, end, size, this.progress, cache);
      if (answer.begin === begin && answer.body.length === end - begin) return answer.body;
      whole = this.#whole[number] = answer.body;
    }
    return whole.subarray(begin, end);
  }
}
