// Sums of texels and of their bytes: keys, differences, means (docs/formats/ptm.md, "Repeats
// coder").

import { damaged } from "../errors.js";

export const K0 = 0x9e3779b1 | 0;
export const K1 = 0x85ebca6b | 0;
export const K2 = 0xc2b2ae35 | 0;
export const K3 = 0x27d4eb2f;
export const K4 = 0x165667b1;
export const K5 = 0xa24baed5 | 0;
const HIGH = 0x80808080 | 0;
const LOW7 = 0x7f7f7f7f;
const EVEN = 0x00ff00ff;
const BOUNDS = [2, 4, 8, 16, 32, 64, 128, 256, 512];
const CLASS = Uint8Array.from({ length: 1024 }, (_, a) => BOUNDS.filter((b) => b <= a).length);
// In 1/64: of W, N, NW, NE for p, q, r.
export const WEIGHTS = [
  [20, 24, -10, -7],
  [2, 27, -12, -2],
  [13, -7, -6, -39],
];

/**
 * a - b, byte by byte.
 * @param {number} a
 * @param {number} b
 */
export function minus(a, b) {
  return ((a | HIGH) - (b & LOW7)) ^ ((a ^ b ^ HIGH) & HIGH);
}

/**
 * @param {number} a
 * @param {number} b
 */
export function plus(a, b) {
  return ((a & LOW7) + (b & LOW7)) ^ ((a ^ b) & HIGH);
}

/** @param {number} activity */
export function classOf(activity) {
  return CLASS[activity < 1023 ? activity : 1023];
}

/**
 * Whether p q r s have that mean in every component.
 * @param {number} mean
 * @param {number} p
 * @param {number} q
 * @param {number} r
 * @param {number} s
 */
export function fits(mean, p, q, r, s) {
  const low = (p & EVEN) + (q & EVEN) + (r & EVEN) + (s & EVEN);
  const high =
    ((p >>> 8) & EVEN) + ((q >>> 8) & EVEN) + ((r >>> 8) & EVEN) + ((s >>> 8) & EVEN);
  return (((low >>> 2) & EVEN) | (((high >>> 2) & EVEN) << 8)) === mean;
}

/** @param {number} value */
export function inByte(value) {
  if (value & ~255) throw damaged("its stream leads to impossible texels");
  return value;
}
