// The head of a file: sizes, levels and their byte ranges, under a checksum of its own
// (docs/formats/ptm.md, "File").

import { crc32 } from "./crc32.js";
import { PtmError } from "./errors.js";
import { tileCounts } from "./tiling.js";

/** No head is longer, so that many bytes always suffice for `readHeader`. */
export const HEAD_MAX = 388;

const MAGIC = [0x89, 0x50, 0x54, 0x4d, 0x0d, 0x0a, 0x1a, 0x0a];
const FIXED = 28;
const TABLE = 44;
const ENTRY = 20;
const MAX_SIDE = 65536;
const MAX_LEVELS = 17;
const DESCRIPTION_MAX = 1 << 24;

/** Profiles that this decoder reads, as files number them. */
export const RAW = 0;
export const FAST = 1;
const PROFILES = ["raw", "fast", "small", "paper"];
const KINDS = ["8-bit", "16-bit", "half float", "float"];

/**
 * One level, and the group that refines the level below to it.
 * @typedef {object} Level
 * @property {number} width texels
 * @property {number} height
 * @property {number} offset where the group begins in the file
 * @property {number} length bytes of the group
 * @property {number} crc32 of the group; where there are several tiles, of their index
 * @property {number} across tiles in a row
 * @property {number} down tiles in a column
 */

/**
 * @typedef {object} Header
 * @property {number} width of the original image, texels
 * @property {number} height
 * @property {number} components 1 grey, 2 grey and alpha, 3 RGB, 4 RGBA
 * @property {number} profile `RAW` or `FAST`
 * @property {number} trimmed how many of the finest levels were left out
 * @property {number} tile side of the tiles, 0 if no level has several
 * @property {number} maxError how far samples may be from their exact values
 * @property {{offset: number, length: number, crc32: number}} description
 * @property {Level[]} levels coarsest first
 */

/**
 * The header of a file, from its first `HEAD_MAX` bytes or more (fewer if the file is shorter).
 *
 * Throws PtmError: PTM-I101 not such a file, or a Polynomial Texture Map, PTM-I103 cut inside
 * the head, PTM-I104 a version, profile or kind of sample that this decoder does not read, PTM-I105
 * damaged, PTM-L104 larger than the format allows. Its memory does not grow with the sizes in the head.
 *
 * @param {Uint8Array} bytes
 * @returns {Header}
 */
export function readHeader(bytes) {
  checkMagic(bytes);
  if (bytes.length < FIXED) throw cutHead(bytes.length);
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const version = view.getUint16(8, true);
  if (version !== 2) {
    throw new PtmError("PTM-I104", `version ${version} is not read here, only 2; encode it again`);
  }
  const count = bytes[21];
  const size = view.getUint32(24, true);
  if (count > MAX_LEVELS || size !== TABLE + ENTRY * count + 4) {
    throw damagedHead("its size does not match the number of levels");
  }
  if (bytes.length < size) throw cutHead(bytes.length);
  if (view.getUint32(size - 4, true) !== crc32(bytes.subarray(0, size - 4))) {
    throw damagedHead("its checksum is wrong");
  }
  const profile = bytes[10];
  if (profile > FAST || bytes[11] !== 0) {
    const samples = `${PROFILES[profile] ?? profile} of ${KINDS[bytes[11]] ?? bytes[11]} samples`;
    throw new PtmError(
      "PTM-I104",
      `profile ${samples} is not read here, only fast and raw of 8 bits; encode it again`,
    );
  }
  const width = view.getUint32(12, true);
  const height = view.getUint32(16, true);
  if (Math.max(width, height) > MAX_SIDE) {
    throw new PtmError("PTM-L104", `${width} x ${height} texels; the format allows ${MAX_SIDE}`);
  }
  const components = bytes[20];
  const trimmed = bytes[22];
  const sizes = storedSizes(width, height, count, trimmed);
  if (!sizes.length || components < 1 || components > 4) {
    throw damagedHead(`${count} levels of ${components} components are impossible here`);
  }
  const tile = view.getUint32(28, true);
  const maxError = view.getUint32(32, true);
  const described = view.getUint32(36, true);
  if (
    bytes[23] ||
    (tile && (tile < 16 || tile > 32768 || tile % 2)) ||
    maxError > (profile === FAST ? 255 : 0) ||
    described > DESCRIPTION_MAX
  ) {
    throw damagedHead("its tiles, error, description or reserved byte are impossible");
  }
  /** @type {Level[]} */
  const levels = [];
  let end = size + described;
  for (const [w, h] of sizes) {
    const entry = TABLE + ENTRY * levels.length;
    const [across, down] = levels.length ? tileCounts(w, h, tile) : [1, 1];
    const offset = long(view, entry);
    const length = long(view, entry + 8);
    // No coder makes a group twice as long as its texels, except for a few bytes.
    if (offset !== end || length > 2 * w * h * components + 1024 * across * down) {
      throw damagedHead(`the byte range of level ${levels.length} is impossible`);
    }
    end += length;
    const crc = view.getUint32(entry + 16, true);
    levels.push({ width: w, height: h, offset, length, crc32: crc, across, down });
  }
  const description = { offset: size, length: described, crc32: view.getUint32(40, true) };
  return { width, height, components, profile, trimmed, tile, maxError, description, levels };
}

/**
 * Sizes of the levels of an image down to the first whose shorter side is 1, coarsest first.
 * @param {number} width
 * @param {number} height
 */
export function pyramidSizes(width, height) {
  const sizes = [[width, height]];
  while (Math.min(width, height) > 1) {
    width >>= 1;
    height >>= 1;
    sizes.unshift([width, height]);
  }
  return sizes;
}

/**
 * Sizes of the stored levels; none for an impossible number of levels.
 * @param {number} width
 * @param {number} height
 * @param {number} count
 * @param {number} trimmed
 */
function storedSizes(width, height, count, trimmed) {
  const sizes = width && height ? pyramidSizes(width, height) : [];
  const finest = sizes.length - trimmed;
  return count && count <= finest ? sizes.slice(finest - count, finest) : [];
}

/**
 * A number of 64 bits, rounded beyond 2^53, where every number is invalid.
 * @param {DataView} view
 * @param {number} at
 */
function long(view, at) {
  return view.getUint32(at, true) + view.getUint32(at + 4, true) * 2 ** 32;
}

/** @param {Uint8Array} bytes */
function checkMagic(bytes) {
  const begin = bytes.subarray(0, MAGIC.length);
  if (begin.length && begin.every((byte, i) => byte === MAGIC[i])) {
    if (begin.length < MAGIC.length) throw cutHead(begin.length);
    return;
  }
  if ([0x50, 0x54, 0x4d, 0x5f, 0x31].every((byte, i) => bytes[i] === byte)) {
    throw new PtmError("PTM-I101", "a Polynomial Texture Map, not a progressive texture map");
  }
  throw new PtmError("PTM-I101", "not a progressive texture map");
}

/** @param {number} size */
function cutHead(size) {
  return new PtmError("PTM-I103", `cut inside its head, after ${size} bytes`);
}

/** @param {string} reason */
function damagedHead(reason) {
  return new PtmError("PTM-I105", `the head is damaged: ${reason}`);
}
