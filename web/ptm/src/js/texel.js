// The texel coder for bytes within an error (docs/formats/ptm-kinds.md, "The texel coder"): numbers
// are values, and no fourth texel follows from the others.

import { damaged } from "../errors.js";
import { tokenTables } from "../families.js";
import { Reader } from "../reader.js";
import { OPAQUE } from "../texels.js";
import { planeOrder, references } from "./planes.js";
import { Symbols, readTables } from "./rans.js";
import { NEIGHBOURS, TEXEL_WEIGHTS } from "./texel-layout.js";

const CODED = 2;
const CODED_WITH_WEIGHTS = 3;
const WINDOW_TOP = 40;
const WEIGHT_SUM = 32767;
const TABLES = 236;
const CLASSES = 18;
const DIRECT = 16;
const PLAIN_TOP = 30;
/** Texels of a frame: above and left, below and right. */
const BEFORE = 2;
const BEHIND = 3;

/**
 * @param {Uint8Array} data from the byte on that names its form
 * @param {Uint32Array} below
 * @param {import("../texels.js").Shape} shape
 * @param {number} error
 */
export function decodeTexels(data, below, shape, error) {
  const { width, height, components } = shape;
  const reader = new Reader(data);
  const form = reader.number(1);
  if ((form !== CODED && form !== CODED_WITH_WEIGHTS) || !below.length) {
    throw damaged(`form ${form} is unknown`);
  }
  if (reader.number(1)) throw damaged("values are numbered although an error is allowed");
  const window = reader.number(1);
  if (window > WINDOW_TOP) throw damaged("its window is impossible");
  const order = planeOrder(components);
  const weights = order.map((_, c) =>
    TEXEL_WEIGHTS[references(components, c)].map((own) =>
      form === CODED ? own : readWeights(reader, references(components, c)),
    ),
  );
  const tables = readTables(reader, TABLES, tokenTables());
  const bits = new PlainBits(reader.take(reader.number(4)));
  const columns = (width + 1) >> 1;
  const symbols = new Symbols(reader, tables, 4 * columns * components);

  const stride = 2 * columns + BEFORE + BEHIND;
  const step = 2 * error + 1;
  const scale = 31 - Math.clz32(step);
  const planes = order.map((component) => enlarged(below, width, height, component, stride));
  const around = NEIGHBOURS.map((own) => own.map(([y, x]) => y * stride + x));
  /** Magnitudes of the errors of four rows. */
  const errors = order.map(() => new Int32Array(4 * stride));
  /** Errors of the block; those of one plane more are no reference. */
  const own = Array.from({ length: components + 1 }, () => new Int32Array(4));
  const out = new Uint32Array(width * height).fill(components === 3 ? OPAQUE : 0);
  for (let y = 0; y < height; y += 2) {
    for (let x = 0; x < width; x += 2) {
      for (let c = 0; c < components; c++) {
        const work = planes[c];
        const magnitudes = errors[c];
        const count = references(components, c);
        const first = own[count > 0 ? 0 : components];
        const second = own[count > 1 ? 1 : components];
        const shift = 8 * order[c];
        for (let k = 0; k < 4; k++) {
          const py = y + (k >> 1);
          const px = x + (k & 1);
          if (py >= height || px >= width) continue;
          const place = (y + BEFORE) * stride + x + BEFORE;
          const here = place + (k >> 1) * stride + (k & 1);
          const w = weights[c][k];
          const beside = around[k];
          const base = work[here];
          let total = w[10] * first[k] + w[11] * second[k] + 2048;
          let slope = 0;
          for (let j = 0; j < 10; j++) {
            const f = work[place + beside[j]] - base;
            total += w[j] * f;
            if (j < 6) slope += Math.abs(f);
          }
          const guess = Math.min(Math.max(base + (total >> 12), 0), 255);
          const row = (py & 3) * stride + px;
          const up = ((py - 1) & 3) * stride + px;
          const n =
            2 * (magnitudes[row + 1] + magnitudes[up + 2]) +
            magnitudes[up + 1] +
            (k < 3 ? magnitudes[up + 3] : magnitudes[row + 1]);
          const e1 = Math.abs(first[k]);
          const activity =
            (count === 0
              ? 16 * n + 2 * slope
              : count === 1
                ? 8 * n + slope + 16 * e1
                : 8 * n + slope + 8 * e1 + 24 * Math.abs(second[k])) >> scale;
          const octave = 32 - Math.clz32(activity) - window;
          const klass = activity ? Math.min(Math.max(octave, 1), CLASSES - 1) : 0;
          const z = number(symbols, bits, CLASSES * (4 * count + k) + klass);
          const e = z % 2 ? -(z + 1) / 2 : z / 2;
          const value = Math.min(Math.max(guess + e * step, 0), 255);
          work[here] = value;
          own[c][k] = value - guess;
          magnitudes[row + 2] = Math.abs(value - guess);
          out[py * width + px] |= value << shift;
        }
      }
    }
    symbols.check();
  }
  symbols.end();
  bits.end();
  return out;
}

/**
 * A number below 2^33: a token, and for large ones plain bits.
 * @param {Symbols} symbols
 * @param {PlainBits} bits
 * @param {number} table
 */
function number(symbols, bits, table) {
  const token = symbols.next(table);
  if (token < DIRECT) return token;
  const count = (token - DIRECT + 8) >> 2;
  if (count > PLAIN_TOP) throw damaged("a number is too large");
  return (4 + (token & 3)) * 2 ** count + bits.next(count);
}

/** Bits from the lowest of each byte upwards; behind the last are zeros. */
class PlainBits {
  /** @param {Uint8Array} bytes */
  constructor(bytes) {
    this.bytes = bytes;
    this.at = 0;
  }

  /** @param {number} count up to 30 */
  next(count) {
    let bits = 0;
    for (let i = 0; i < count; i++, this.at++) {
      bits |= (((this.bytes[this.at >> 3] ?? 0) >> (this.at & 7)) & 1) << i;
    }
    return bits;
  }

  end() {
    if ((this.at + 7) >> 3 !== this.bytes.length) throw damaged("its plain bits are left or lacking");
  }
}

/**
 * @param {Reader} reader
 * @param {number} others
 */
function readWeights(reader, others) {
  const weights = Array(12).fill(0);
  for (let i = 0; i < 10 + others; i++) weights[i] = reader.signed();
  if (weights.reduce((sum, w) => sum + Math.abs(w), 0) > WEIGHT_SUM) {
    throw damaged("a weight is out of range");
  }
  return weights;
}

/**
 * A component of the level below at twice its size, with a frame.
 * @param {Uint32Array} below
 * @param {number} width of the level
 * @param {number} height
 * @param {number} component
 * @param {number} stride
 */
function enlarged(below, width, height, component, stride) {
  const bw = width >> 1;
  const bh = height >> 1;
  const rows = height + (height & 1) + BEFORE + BEHIND;
  const out = new Uint8Array(rows * stride);
  for (let y = 0; y < rows; y++) {
    const from = Math.min(Math.max((y - BEFORE) >> 1, 0), bh - 1) * bw;
    for (let x = 0; x < stride; x++) {
      const texel = below[from + Math.min(Math.max((x - BEFORE) >> 1, 0), bw - 1)];
      out[y * stride + x] = texel >>> (8 * component);
    }
  }
  return out;
}
