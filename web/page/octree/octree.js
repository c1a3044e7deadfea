// An octree texture that comes by levels: its stream, and its texels on the graphics card
// (docs/formats/apo.md; Lacoste et al., sections 4.1 and 4.2).

import { crc32 } from "../../ptm/src/crc32.js";
import { PageError } from "../net/errors.js";

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

/** The texels of one stream on the graphics card. */
class Texels {
  /** Rows that were uploaded. */
  #rows = 0;

  /** @param {WebGL2RenderingContext} gl @param {number} count */
  constructor(gl, count) {
    this.gl = gl;
    const height = Math.max(1, Math.ceil(count / WIDTH));
    this.bytes = new Uint8Array(4 * WIDTH * height);
    this.texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA8UI, WIDTH, height);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) {
      gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
    }
  }

  /** Uploads the rows up to a texel, the last of which is uploaded again as it fills. @param {number} end */
  upload(end) {
    const { gl } = this, rows = Math.ceil(end / WIDTH);
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, this.#rows, WIDTH, rows - this.#rows, gl.RGBA_INTEGER,
      gl.UNSIGNED_BYTE, this.bytes, 4 * WIDTH * this.#rows);
    this.#rows = Math.floor(end / WIDTH);
  }
}

export class Octree {
  /** Texels of `#streams` that are there, of the level on its way. */
  #arrived = [0, 0];

  /**
   * @param {WebGL2RenderingContext} gl
   * @param {OctreeIndex} index
   * @param {(file: string) => string} urlOf
   * @param {import("../net/fetcher.js").Fetcher} fetcher
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
      throw new PageError("PTM-V101", "This graphics card has no textures of 4,096 texels.");
    }
    this.streams = index.streams;
    this.texels = this.streams.map(() => new Texels(gl, this.count));
    /** Complete levels, and whether the next one is there in part. */
    this.levels = 0;
    this.partial = false;
    this.updates = 0;
    this.running = false;
  }

  /** Whether all levels are there. */
  get complete() {
    return this.levels === this.index.levels.length;
  }

  delete() {
    for (const { texture } of this.texels) this.gl.deleteTexture(texture);
  }

  /** Bytes on the graphics card. */
  get bytes() {
    return this.texels.reduce((sum, { bytes }) => sum + bytes.length, 0);
  }

  /** Bytes of the file up to the last complete level. */
  get fetched() {
    return this.levels ? this.streams.reduce((sum, { ends }) => sum + ends[this.levels - 1], 0) : 0;
  }

  /**
   * Fetches the next levels, if none is on its way and they are wanted.
   * @param {(levels: number) => boolean} wanted whether more than these levels are
   * @param {(fault: unknown) => void} fail
   * @param {() => void} [done] called when they are there
   */
  advance(wanted, fail, done) {
    if (this.running || this.complete || !wanted(this.levels)) return;
    this.running = true;
    this.#next().then(() => {
      this.running = false;
      done?.();
    }, fail);
  }

  async #next() {
    const total = this.index.levels.length;
    const end = this.levels ? this.levels + 1 : Math.min(FIRST, total);
    this.#arrived = [0, 0];
    const timer = this.step && this.levels ? setInterval(() => this.#show(), 1000 * this.step) : 0;
    try {
      await Promise.all(this.streams.map((stream, k) => this.#fetch(stream, k, this.levels, end)));
    } finally {
      clearInterval(timer);
    }
    for (const texels of this.texels) texels.upload(this.starts[end]);
    this.updates++;
    this.levels = end;
    this.partial = false;
  }

  /** Uploads what is there of a level. */
  #show() {
    const there = Math.min(...this.#arrived.slice(0, this.streams.length));
    if (there <= this.starts[this.levels]) return;
    for (const texels of this.texels) texels.upload(there);
    this.updates++;
    this.partial = true;
  }

  /**
   * Fetches and inflates levels `from` to before `to` of a stream.
   * @param {Stream} stream @param {number} number of it @param {number} from @param {number} to
   */
  async #fetch(stream, number, from, to) {
    const size = /** @type {number} */ (stream.ends.at(-1));
    const begin = from ? stream.ends[from - 1] : HEAD;
    const end = stream.ends[to - 1] - (to === stream.ends.length ? CHECK : 0);
    const url = this.urlOf(stream.file), { bytes } = this.texels[number];
    /** @param {RequestCache} cache */
    const attempt = async (cache) => {
      const inflating = new DecompressionStream("deflate-raw"), writer = inflating.writable.getWriter();
      let at = 4 * this.starts[from];
      const reading = (async () => {
        for (const reader = inflating.readable.getReader(); ; ) {
          const { done, value } = await reader.read();
          if (done) return;
          demand(at + value.length <= 4 * this.starts[to], "more texels than the index says");
          bytes.set(value, at);
          at += value.length;
          this.#arrived[number] = Math.floor(at / 4);
        }
      })();
      reading.catch(() => {}); // awaited below
      const piece = this.step && from ? PIECE : end - begin;
      for (let place = begin; place < end; place += piece) {
        const answer = await this.fetcher.range(url, place, Math.min(place + piece, end), size, undefined, cache);
        const skipped = place - answer.begin;
        const body = answer.body.subarray(skipped, skipped + Math.min(piece, end - place));
        await Promise.race([writer.write(body), reading]);
      }
      if (to < stream.ends.length) await Promise.race([writer.write(END), reading]);
      await Promise.all([writer.close(), reading]);
      demand(at === 4 * this.starts[to], "fewer texels than the index says");
      for (let level = from; level < to; level++) {
        const texels = bytes.subarray(4 * this.starts[level], 4 * this.starts[level + 1]);
        demand(crc32(texels) === stream.crc32[level], `level ${level} has another checksum`);
      }
    };
    try {
      await attempt("default");
    } catch (fault) {
      if (fault instanceof PageError) throw fault;
      await attempt("no-store").catch((again) => {
        if (again instanceof PageError) throw again;
        throw new PageError("PTM-V105", `${stream.file} is damaged: ${again.message}`);
      });
    }
  }
}
