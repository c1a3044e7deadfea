// Frequency tables and interleaved rANS (docs/formats/ptm.md, "Tables and symbols").

import { damaged } from "../errors.js";

/** Symbols of this number escape to a value of 16 bits. */
export const ESCAPE = 255;
export const SUM = 2048;
const STATE_LOW = 1 << 15;
const FIRST_KIND = 4;
/** No block and no texel takes more symbols, so that room for a row's is enough to be safe. */
const PADDING = 32;

/**
 * Tables to decode with: the symbol of each of 2048 slots, and of each of 256 symbols its frequency
 * << 12 | where its slots begin.
 * @typedef {object} Tables
 * @property {Uint8Array} slots
 * @property {Int32Array} intervals
 */

/** Numbers of three bits a nibble. */
class Nibbles {
  /** @param {Uint8Array} bytes */
  constructor(bytes) {
    this.bytes = bytes;
    this.at = 0;
  }

  next() {
    let n = 0;
    for (let shift = 0; ; shift += 3) {
      const i = this.at++;
      if (i >= 2 * this.bytes.length || shift > 9) {
        throw damaged("its tables are cut short or hold a number above 4095");
      }
      const nibble = this.bytes[i >> 1] >> (4 * (i & 1));
      n |= (nibble & 7) << shift;
      if (!(nibble & 8)) return n;
    }
  }
}

/**
 * @param {import("../reader.js").Reader} reader
 * @param {number} count how many tables there are
 * @param {Uint16Array} family the built-in tables, 256 frequencies each
 * @returns {Tables}
 */
export function readTables(reader, count, family) {
  const numbers = new Nibbles(reader.take(reader.number(2)));
  const kinds = new Uint8Array(count);
  let kind = FIRST_KIND;
  let t = 0;
  while (t < count) {
    const n = numbers.next();
    if (n === 0) {
      t += 1 + numbers.next();
    } else {
      if (n > 1) {
        kind += n & 1 ? -((n - 1) >> 1) : (n - 2) >> 1;
        if (kind < 1 || 256 * kind > family.length) throw damaged("a table is of an unknown kind");
      }
      kinds[t++] = n === 1 ? ESCAPE : kind;
    }
  }
  if (t > count) throw damaged("it has too many tables");
  const slots = new Uint8Array(SUM * count);
  const intervals = new Int32Array(256 * count);
  const sent = new Uint16Array(256);
  for (t = 0; t < count; t++) {
    if (!kinds[t]) continue;
    if (kinds[t] === ESCAPE) readSent(numbers, sent);
    const f = kinds[t] === ESCAPE ? sent : family.subarray(256 * (kinds[t] - 1), 256 * kinds[t]);
    for (let z = 0, at = 0; z < 256; z++) {
      if (!f[z]) continue;
      slots.fill(z, SUM * t + at, SUM * t + at + f[z]);
      intervals[256 * t + z] = (f[z] << 12) | at;
      at += f[z];
    }
  }
  return { slots, intervals };
}

/**
 * @param {Nibbles} numbers
 * @param {Uint16Array} f overwritten
 */
function readSent(numbers, f) {
  f.fill(0);
  f[ESCAPE] = numbers.next();
  let sum = f[ESCAPE];
  const used = numbers.next();
  if (used > ESCAPE) throw damaged("a table has too many symbols");
  for (let z = 0; z < used; z++) sum += f[z] = numbers.next();
  if (sum !== SUM) throw damaged(`a table does not sum to ${SUM}`);
}

/** The symbols of a group. */
export class Symbols {
  #state = new Int32Array(4);
  #lane = 0;
  #word = 8;
  #escape = 0;

  /**
   * @param {import("../reader.js").Reader} reader what is left of it is the stream
   * @param {Tables} tables
   * @param {number} row how many symbols are decoded, at most, before `check`
   */
  constructor(reader, tables, row) {
    const escapes = reader.take(2 * reader.number(4));
    const words = reader.rest();
    if (words.length < 16 || words.length % 2) {
      throw damaged("its stream is not a whole number of words");
    }
    this.escapes = numbers16(escapes, 0);
    this.words = numbers16(words, row + PADDING);
    this.limit = words.length / 2;
    this.tables = tables;
    for (let lane = 0; lane < 4; lane++) {
      this.#state[lane] = this.words[2 * lane] | ((this.words[2 * lane + 1] & 0x7fff) << 16);
    }
  }

  /**
   * The next symbol, by that table; 255 stands for itself.
   * @param {number} table
   */
  plain(table) {
    const { slots, intervals } = this.tables;
    const lane = this.#lane;
    this.#lane = (lane + 1) & 3;
    let x = this.#state[lane];
    const slot = x & (SUM - 1);
    const z = slots[SUM * table + slot];
    const interval = intervals[256 * table + z];
    x = Math.imul(interval >> 12, x >> 11) + slot - (interval & 4095);
    if (x < STATE_LOW) x = (x << 16) | this.words[this.#word++];
    this.#state[lane] = x;
    return z;
  }

  /**
   * The next symbol, by that table.
   * @param {number} table
   */
  next(table) {
    const z = this.plain(table);
    return z === ESCAPE ? this.escaped() : z;
  }

  /** What stands in the place of a symbol 255. */
  escaped() {
    if (this.#escape === this.escapes.length) throw damaged("it has too few escapes");
    return this.escapes[this.#escape++];
  }

  /**
   * The next symbol as a residual: 0, -1, 1, -2, 2 …
   * @param {number} table
   */
  residual(table) {
    const z = this.next(table);
    return (z >> 1) ^ -(z & 1);
  }

  /**
   * So many symbols, whose tables are known before: the four states work side by side.
   * @param {Uint8Array} tables of each
   * @param {number} n
   * @param {Int32Array} out
   */
  row(tables, n, out) {
    const { slots, intervals } = this.tables;
    const words = this.words;
    const states = this.#state;
    let word = this.#word;
    let i = 0;
    if (n > 3) {
      const first = this.#lane;
      let a = states[first];
      let b = states[(first + 1) & 3];
      let c = states[(first + 2) & 3];
      let d = states[(first + 3) & 3];
      for (; i < n - 3; i += 4) {
        let t = tables[i];
        let slot = a & 2047;
        let z = slots[(t << 11) | slot];
        let interval = intervals[(t << 8) | z];
        a = Math.imul(interval >> 12, a >> 11) + slot - (interval & 4095);
        if (a < STATE_LOW) a = (a << 16) | words[word++];
        out[i] = z;
        t = tables[i + 1];
        slot = b & 2047;
        z = slots[(t << 11) | slot];
        interval = intervals[(t << 8) | z];
        b = Math.imul(interval >> 12, b >> 11) + slot - (interval & 4095);
        if (b < STATE_LOW) b = (b << 16) | words[word++];
        out[i + 1] = z;
        t = tables[i + 2];
        slot = c & 2047;
        z = slots[(t << 11) | slot];
        interval = intervals[(t << 8) | z];
        c = Math.imul(interval >> 12, c >> 11) + slot - (interval & 4095);
        if (c < STATE_LOW) c = (c << 16) | words[word++];
        out[i + 2] = z;
        t = tables[i + 3];
        slot = d & 2047;
        z = slots[(t << 11) | slot];
        interval = intervals[(t << 8) | z];
        d = Math.imul(interval >> 12, d >> 11) + slot - (interval & 4095);
        if (d < STATE_LOW) d = (d << 16) | words[word++];
        out[i + 3] = z;
      }
      states[first] = a;
      states[(first + 1) & 3] = b;
      states[(first + 2) & 3] = c;
      states[(first + 3) & 3] = d;
    }
    this.#word = word;
    for (; i < n; i++) out[i] = this.plain(tables[i]);
  }

  /** Once a row or block: whether the stream was long enough. */
  check() {
    if (this.#word > this.limit) throw damaged("its stream ends early");
  }

  /** Whether all of the stream has been used. */
  end() {
    const clean = this.#state.every((state) => state === STATE_LOW);
    if (!clean || this.#word !== this.limit || this.#escape !== this.escapes.length) {
      throw damaged("its stream leads to impossible texels");
    }
  }
}

/**
 * Numbers of two bytes, which may lie at odd addresses, with zeros behind them.
 * @param {Uint8Array} bytes
 * @param {number} more
 */
function numbers16(bytes, more) {
  const numbers = new Uint16Array(bytes.length / 2 + more);
  new Uint8Array(numbers.buffer).set(bytes);
  return numbers;
}
