// Decodes groups to levels, each refining the one before it; tile by tile, checksums first.

import { FAST, RAW, pyramidSizes } from "./container.js";
import { PtmError, damaged } from "./errors.js";
import { Reader } from "./reader.js";
import { asBytes, rawTexels, storedTexels, toNative, toRgba, unknownCoder } from "./texels.js";
import { tileSpan } from "./tiling.js";

/** @typedef {import("./container.js").Header} Header */
/** @typedef {import("./engine.js").Engine} Engine */
/** @typedef {import("./texels.js").Shape} Shape */

/**
 * @typedef {object} Image
 * @property {number} level
 * @property {number} width texels
 * @property {number} height
 * @property {number} channels bytes of a texel: 4 as "rgba", else the components of the file
 * @property {Uint8Array<ArrayBuffer>} data rows from the top; in a buffer of its own
 */

/**
 * @typedef {object} DecoderOptions
 * @property {"rgba" | "native"} [format] of the texels that come out; "rgba" is ready for upload
 * @property {number} [memory] bytes that decoding may take, `DEFAULT_MEMORY` unless given
 */

/** 256 MiB: enough for 5000² texels in tiles of 512, for 3000² without. */
export const DEFAULT_MEMORY = 2 ** 28;
/** Upper limit: texels are counted in 30 bits. */
const MOST_MEMORY = 2 ** 31;

/** Coders of a group of `fast`. */
const STORED = 0;
const HAAR = 4;
const REPEATS = 5;
const PYRAMID = 6;
/** Forms of a tile within an error. */
const PLAIN = 1;
/** Tables of an engine, at most. */
const FIXED_MEMORY = 2 ** 21;

/**
 * Bytes that decoding a level takes at most: its texels and those below it, the image, and of
 * its largest tile the bytes, the texels and those below, and the rows that are under way.
 * @param {Header} header
 * @param {number} number of the level
 */
export function memoryNeeded(header, number) {
  const { width, height, across, down } = header.levels[number];
  const texels = width * height;
  const w = across > 1 ? width - (across - 1) * header.tile : width;
  const h = down > 1 ? height - (down - 1) * header.tile : height;
  const tile = w * h * (5 + 2 * header.components + (header.maxError ? 2 * header.components : 0));
  return FIXED_MEMORY + 9 * texels + tile + 256 * (w + h);
}

/** Decodes the levels of a file one after the other; see `refine`. */
export class LevelDecoder {
  /**
   * The texels of the level decoded last.
   * @type {Uint32Array}
   */
  #texels = new Uint32Array(0);

  /**
   * @param {Header} header
   * @param {Engine} engine
   * @param {DecoderOptions} [options]
   */
  constructor(header, engine, { format = "rgba", memory = DEFAULT_MEMORY } = {}) {
    this.header = header;
    this.engine = engine;
    this.format = format;
    this.memory = Math.min(memory, MOST_MEMORY);
    /** The level decoded last, -1 at first. */
    this.level = -1;
  }

  /**
   * The next level from its group, all of its bytes. An error leaves the decoder unchanged, so that
   * correct bytes may follow.
   *
   * Throws PtmError: PTM-I111 no further level, PTM-I103 too few bytes, PTM-I108 a wrong
   * checksum, PTM-I112 bytes that no encoder writes, PTM-L103 beyond the limit of memory.
   *
   * @param {Uint8Array} data
   * @returns {Image}
   */
  refine(data) {
    const number = this.level + 1;
    const level = this.header.levels[number];
    if (!level) throw new PtmError("PTM-I111", `there is no level ${number}`);
    const needed = memoryNeeded(this.header, number);
    if (needed > this.memory) {
      throw new PtmError(
        "PTM-L103",
        `level ${number} takes up to ${needed} bytes to decode, more than the limit ${this.memory}`,
      );
    }
    if (data.length < level.length) {
      throw new PtmError("PTM-I103", `level ${number} has ${data.length} of ${level.length} bytes`);
    }
    const group = data.subarray(0, level.length);
    const { components } = this.header;
    const shape = { width: level.width, height: level.height, components };
    const tiled = level.across * level.down > 1;
    const texels = tiled
      ? this.#tiles(group, number)
      : this.#tile(this.#checked(group, level.crc32, `level ${number}`), this.#texels, shape, !number);
    const channels = this.format === "rgba" ? 4 : components;
    // Nothing refines the finest level. An engine may overwrite its result, tiles are copied out of it.
    const last = number === this.header.levels.length - 1;
    const ready = last && tiled && channels === 4 && components > 2;
    const convert = channels === 4 ? toRgba : toNative;
    const out = ready ? asBytes(texels) : convert(texels, components);
    this.#texels = last ? new Uint32Array(0) : tiled ? texels : texels.slice();
    this.level = number;
    return { level: number, width: level.width, height: level.height, channels, data: out };
  }

  /**
   * @param {Uint8Array} group
   * @param {number} number
   */
  #tiles(group, number) {
    const { components, levels, tile: side } = this.header;
    const { width, height, across, down, crc32: crc } = levels[number];
    const below = this.#texels;
    const size = 8 * across * down;
    if (size > group.length) throw wrongIndex(number);
    const index = new Reader(this.#checked(group.subarray(0, size), crc, `level ${number}`));
    const reader = new Reader(group.subarray(size));
    const out = new Uint32Array(width * height);
    for (let row = 0; row < down; row++) {
      const [y, h] = tileSpan(row, down, side, height);
      for (let column = 0; column < across; column++) {
        const [x, w] = tileSpan(column, across, side, width);
        const length = index.number(4);
        if (length > group.length - size - reader.at) throw wrongIndex(number);
        const place = `level ${number}, tile ${row * across + column}`;
        const data = this.#checked(reader.take(length), index.number(4), place);
        const under = new Uint32Array((w >> 1) * (h >> 1));
        copyRows(below, (y >> 1) * (width >> 1) + (x >> 1), width >> 1, under, 0, w >> 1, w >> 1);
        const shape = { width: w, height: h, components };
        copyRows(this.#tile(data, under, shape, false), 0, w, out, y * width + x, width, w);
      }
    }
    if (reader.at < reader.bytes.length) throw wrongIndex(number);
    return out;
  }

  /**
   * @param {Uint8Array} data
   * @param {number} crc
   * @param {string} place
   */
  #checked(data, crc, place) {
    if (this.engine.crc32(data) !== crc) {
      throw new PtmError("PTM-I108", `${place}: the checksum is wrong`);
    }
    return data;
  }

  /**
   * @param {Uint8Array} data
   * @param {Uint32Array} below
   * @param {Shape} shape
   * @param {boolean} base whether it is level 0
   */
  #tile(data, below, shape, base) {
    const { profile, maxError } = this.header;
    if (base) return this.#base(data, shape);
    if (!maxError) return this.#exact(data, below, shape, profile);
    const reader = new Reader(data);
    const within = reader.number(1);
    if (within > 1) throw damaged("it is neither exact nor within the error");
    if (!within) return this.#exact(reader.rest(), below, shape, profile);
    const form = reader.bytes[reader.at];
    if (form === PLAIN) return storedTexels(reader.rest().subarray(1), shape);
    return this.engine.texel(reader.rest(), below, shape, maxError);
  }

  /**
   * @param {Uint8Array} data
   * @param {Uint32Array} below
   * @param {Shape} shape
   * @param {number} profile
   */
  #exact(data, below, shape, profile) {
    if (profile === RAW) return rawTexels(data, below, shape);
    const reader = new Reader(data);
    const coder = reader.number(1);
    const body = reader.rest();
    if (coder === HAAR) return this.engine.haar(body, below, shape);
    if (coder === REPEATS) return this.engine.repeats(body, below, shape);
    if (coder === STORED) return rawTexels(body, below, shape);
    throw unknownCoder(coder);
  }

  /**
   * @param {Uint8Array} data
   * @param {Shape} shape
   */
  #base(data, shape) {
    if (this.header.profile === RAW) return storedTexels(data, shape);
    const reader = new Reader(data);
    const coder = reader.number(1);
    if (coder === STORED) return storedTexels(reader.rest(), shape);
    if (coder !== PYRAMID) throw unknownCoder(coder);
    let texels = new Uint32Array(0);
    for (const [width, height] of pyramidSizes(shape.width, shape.height)) {
      const group = reader.take(reader.number(4));
      const own = { width, height, components: shape.components };
      texels = this.#exact(group, texels, own, FAST).slice();
    }
    reader.end();
    return texels;
  }
}

/** @param {number} number */
function wrongIndex(number) {
  return damaged(`level ${number}: the index of its tiles contradicts its length`);
}

/**
 * Rows of a rectangle from one array to another, as many as fit into the target or the source.
 * @param {Uint32Array} from
 * @param {number} at
 * @param {number} stride
 * @param {Uint32Array} to
 * @param {number} place
 * @param {number} step
 * @param {number} width
 */
function copyRows(from, at, stride, to, place, step, width) {
  if (!width) return;
  for (; at + width <= from.length && place + width <= to.length; at += stride, place += step) {
    to.set(from.subarray(at, at + width), place);
  }
}
