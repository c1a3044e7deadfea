// The repeats coder (docs/formats/ptm.md, "Repeats coder"): blocks and texels that repeat.
// Texels and keys are signed numbers of 32 bits here, which comes to the same.

import { damaged } from "../errors.js";
import { geometricTables } from "../families.js";
import { Reader } from "../reader.js";
import { OPAQUE } from "../texels.js";
import { edgePlaces, median, planeOrder, references } from "./planes.js";
import { Symbols, readTables } from "./rans.js";
import { K0, K1, K2, K3, K4, K5, WEIGHTS, classOf, fits, inByte, minus, plus } from "./repeats-texels.js";

/** First table of each sort of symbol; tables. */
const [GUESS, TEXEL, LAST, EDGE, EDGE_SAMPLE] = [12, 24, 60, 72, 84];
const [HAAR, SAMPLE, REMAINDER, RUN, TABLES] = [85, 145, 185, 188, 196];
/** What follows the three guesses: texel by texel. */
const TEXELS = 3;
/** Blocks of a run; symbols of a block, with room to spare. */
const [LONGEST_RUN, MOST_SYMBOLS] = [254, 32];

class Group {
  /**
   * @param {Uint8Array} data
   * @param {Uint32Array} below
   * @param {import("../texels.js").Shape} shape
   */
  constructor(data, below, { width, height, components }) {
    this.width = width;
    this.height = height;
    this.components = components;
    this.bw = width >> 1;
    this.bh = height >> 1;
    /** Above the components there are zeros here. */
    this.below = new Int32Array(below);
    if (components === 3) for (let i = 0; i < below.length; i++) this.below[i] &= ~OPAQUE;
    this.texels = new Int32Array(width * height);
    this.order = planeOrder(components);
    this.shift = Math.min(Math.max(Math.clz32(below.length), 19), 26);
    const slots = 2 ** (32 - this.shift);
    this.first = new Int32Array(slots);
    this.trust = new Uint8Array(slots);
    /** Places of blocks and 1, 0 where there is none: `around`, `mean`, `change`. */
    this.around = new Int32Array(slots);
    this.mean = new Int32Array(slots);
    this.change = new Int32Array(slots);
    this.seen = new Int32Array(slots);
    const reader = new Reader(data);
    const tables = readTables(reader, TABLES, geometricTables());
    this.symbols = new Symbols(reader, tables, MOST_SYMBOLS);
  }

  decode() {
    const { bw, bh, below, texels, width, symbols } = this;
    /** 1 where the block above was new. */
    const missed = new Uint8Array(bw);
    for (let y = 0; y < bh; y++) {
      let before = 0;
      let ended = false;
      for (let x = 0; x < bw; ) {
        /** @type {number} */
        const run = ended ? 0 : this.run(y, x);
        let flat = 0;
        if (run) {
          const rest = symbols.next(RUN + 31 - Math.clz32(run));
          if (rest > run) throw damaged("a run is too short");
          flat = run - rest;
          for (let i = 0; i < flat; i++) {
            const at = 2 * (y * width + x + i);
            const mean = below[y * bw + x];
            this.put(at, mean, mean, mean, mean);
            missed[x + i] = 0;
          }
          before = flat ? 0 : before;
          x += flat;
        }
        ended = flat < run;
        if (!flat) {
          before = missed[x] = this.block(y, x, before + missed[x]);
          ended = false;
          x++;
        }
        symbols.check();
      }
    }
    for (const at of edgePlaces(width, this.height)) {
      texels[at] = this.edgeTexel(at);
      symbols.check();
    }
    symbols.end();
    if (this.components === 3) for (let i = 0; i < texels.length; i++) texels[i] |= OPAQUE;
    return new Uint32Array(texels.buffer);
  }

  /**
   * How many blocks from here on would be flat if they were like all around them; 0 for none.
   * @param {number} y
   * @param {number} x
   */
  run(y, x) {
    const { below, texels, width, bw } = this;
    if (!y) return 0;
    const from = y * bw + x;
    const mean = below[from];
    const at = 2 * (y * width + x);
    if (x && (texels[at - 1] !== mean || texels[at + width - 1] !== mean)) return 0;
    let many = 0;
    const most = Math.min(LONGEST_RUN, bw - x);
    for (let above = at - width; many < most; above += 2, many++) {
      if (below[from + many] !== mean || texels[above] !== mean || texels[above + 1] !== mean) break;
    }
    return many;
  }

  /**
   * @param {number} at
   * @param {number} p @param {number} q @param {number} r @param {number} s
   */
  put(at, p, q, r, s) {
    const { texels, width } = this;
    texels[at] = p;
    texels[at + 1] = q;
    texels[at + width] = r;
    texels[at + width + 1] = s;
  }

  /**
   * A block as at another place, with a change of its bytes.
   * @param {number} at
   * @param {number} place
   * @param {number} change
   */
  copy(at, place, change) {
    const { texels: t, width } = this;
    const [p, q] = [plus(t[place], change), plus(t[place + 1], change)];
    this.put(at, p, q, plus(t[place + width], change), plus(t[place + width + 1], change));
  }

  /** @param {number} key */
  slot(key) {
    return Math.imul(key ^ (key >>> 15), K1) >>> this.shift;
  }

  /**
   * Decodes a block; 1 if it was not found as a whole, else 0.
   * @param {number} y
   * @param {number} x
   * @param {number} near
   */
  block(y, x, near) {
    const { below, texels, width, bw, bh, symbols } = this;
    const here = y * bw + x;
    const at = 2 * (y * width + x);
    const up = at - width;
    const i = below[here];
    const w0 = x ? texels[at - 1] : i;
    const w1 = x ? texels[at + width - 1] : i;
    const n0 = y ? texels[up] : i;
    const n1 = y ? texels[up + 1] : i;

    const first = this.slot(
      Math.imul(i, K0) + Math.imul(n0, K2) + Math.imul(n1, K3) + Math.imul(w0, K4) + Math.imul(w1, K5) | 0,
    );
    const trust = this.trust[first];
    if (!symbols.next(3 * trust + near)) {
      if (trust) {
        if (trust < 3) this.trust[first]++;
        this.copy(at, this.first[first], 0);
      } else {
        this.first[first] = at;
        this.trust[first] = 1;
        this.put(at, i, i, i, i);
      }
      return 0;
    }
    this.first[first] = at;
    this.trust[first] = 1;

    const north = y ? here - bw : here;
    const south = y + 1 < bh ? here + bw : here;
    const west = x ? 1 : 0;
    const east = x + 1 < bw ? 1 : 0;
    const e = below[here + east];
    const s = below[south];
    const sw = below[south - west];
    const se = below[south + east];
    const around = this.slot(
      Math.imul(i, K0) + Math.imul(e, K1) + Math.imul(s, K2) + Math.imul(below[north], K3) +
        Math.imul(below[here - west], K4) + Math.imul(se ^ 0x55, K5) +
        Math.imul(3, Math.imul(sw, K1) + Math.imul(below[north + east], K4) | 0) +
        Math.imul(5, below[north - west]) | 0,
    );
    const mean = this.slot(Math.imul(i, K0));
    const change = this.slot(
      Math.imul(minus(n0, i), K0) + Math.imul(minus(n1, i), K2) + Math.imul(minus(w0, i), K3) +
        Math.imul(minus(w1, i), K4) + Math.imul(minus(e, i), K5) + Math.imul(minus(s, i), K1) | 0,
    );
    const places = [this.around[around], this.mean[mean], this.change[change]];
    const found = symbols.next(GUESS + 4 * near + (places[0] ? 1 : 0) + (places[1] ? 2 : 0));
    this.around[around] = this.mean[mean] = this.change[change] = at + 1;
    if (found < TEXELS) {
      const place = places[found] - 1;
      if (place < 0) this.put(at, i, i, i, i);
      else this.copy(at, place, found === 2 ? minus(i, this.meanAt(place)) : 0);
      return 0;
    }
    const nw = !y ? w0 : x ? texels[up - 1] : n0;
    const ne = !y ? i : east ? texels[up + 2] : n1;
    if (found === TEXELS) this.texelByTexel(at, i, w0, w1, n0, n1, nw, ne, near);
    else this.differences(at, i, w0, w1, n0, n1, e, s, sw, se);
    const [p, q, r] = [texels[at], texels[at + 1], texels[at + width]];
    this.seen[this.slotOf(i, K0, w0, K2, n0, K3, nw, K4, n1, K5)] = p;
    this.seen[this.slotOf(i, K1, p, K2, n1, K3, n0, K4, ne, K5)] = q;
    this.seen[this.slotOf(i, K2, w1, K3, p, K4, w0, K5, q, K0)] = r;
    this.seen[this.slotOf(i, K3, p, K4, q, K5, r, K0, 0, 0)] = texels[at + width + 1];
    return 1;
  }

  /**
   * The mean of the block at that place.
   * @param {number} place
   */
  meanAt(place) {
    const y = Math.floor(place / this.width) >> 1;
    return this.below[y * this.bw + ((place - 2 * y * this.width) >> 1)];
  }

  /**
   * @param {number} a @param {number} ka @param {number} b @param {number} kb
   * @param {number} c @param {number} kc @param {number} d @param {number} kd
   * @param {number} e @param {number} ke
   */
  slotOf(a, ka, b, kb, c, kc, d, kd, e, ke) {
    const { imul } = Math;
    return this.slot(imul(a, ka) + imul(b, kb) + imul(c, kc) + imul(d, kd) + imul(e, ke) | 0);
  }

  /**
   * @param {number} at
   * @param {number} i the mean @param {number} w0 @param {number} w1 @param {number} n0 @param {number} n1
   * @param {number} nw @param {number} ne
   * @param {number} near
   */
  texelByTexel(at, i, w0, w1, n0, n1, nw, ne, near) {
    const { seen, symbols } = this;
    const table = TEXEL + 4 * near;
    const seenP = seen[this.slotOf(i, K0, w0, K2, n0, K3, nw, K4, n1, K5)];
    const p = this.texel(0, table, seenP, i, w0, n0, nw, n1);
    const seenQ = seen[this.slotOf(i, K1, p, K2, n1, K3, n0, K4, ne, K5)];
    const q = this.texel(1, table, seenQ, i, p, n1, n0, ne);
    const seenR = seen[this.slotOf(i, K2, w1, K3, p, K4, w0, K5, q, K0)];
    const r = this.texel(2, table, seenR, i, w1, p, w0, q);
    const last = seen[this.slotOf(i, K3, p, K4, q, K5, r, K0, 0, 0)];
    /** @type {number[]} */
    const choices = [];
    for (const one of [last, r, q, p, w1]) {
      if (!choices.includes(one) && fits(i, p, q, r, one)) choices.push(one);
    }
    const many = choices.length;
    const place = many ? symbols.next(LAST + 4 * near + Math.min(many - 1, 3)) : 0;
    this.put(at, p, q, r, place < many ? choices[place] : this.remainders(i, p, q, r));
  }

  /**
   * p, q or r: one of those around, or new.
   * @param {number} position
   * @param {number} table
   * @param {number} seen
   * @param {number} i the mean
   * @param {number} w @param {number} n @param {number} nw @param {number} ne
   */
  texel(position, table, seen, i, w, n, nw, ne) {
    const { symbols, components, order } = this;
    const alike = (w === n ? 1 : 0) + (seen === w || seen === n ? 2 : 0);
    const found = symbols.next(table + 12 * position + alike);
    if (found < 5) return [seen, w, n, nw, ne][found];
    const [a, b, c, d] = WEIGHTS[position];
    let texel = 0;
    let reference = 0;
    for (let j = 0; j < components; j++) {
      const shift = 8 * order[j];
      const mean = (i >>> shift) & 255;
      const fw = ((w >>> shift) & 255) - mean;
      const fn = ((n >>> shift) & 255) - mean;
      const fnw = ((nw >>> shift) & 255) - mean;
      const fne = ((ne >>> shift) & 255) - mean;
      let guess = mean + ((a * fw + b * fn + c * fnw + d * fne + 32) >> 6);
      let activity = Math.abs(fw - fn) + Math.abs(fn - fne) + Math.abs(fw) + Math.abs(fn);
      let context = SAMPLE + (position ? 10 : 0);
      if (references(components, j)) {
        guess += reference;
        activity = (activity >> 2) + 4 * Math.abs(reference);
        context += 20;
      }
      guess = guess < 0 ? 0 : guess > 255 ? 255 : guess;
      const value = (guess + symbols.residual(context + classOf(activity))) & 255;
      if (j === 0) reference = value - guess;
      else if (j === 1) reference += (value - guess) >> 1;
      texel |= value << shift;
    }
    return texel;
  }

  /**
   * s by the remainder of the sum.
   * @param {number} i @param {number} p @param {number} q @param {number} r
   */
  remainders(i, p, q, r) {
    let texel = 0;
    for (const component of this.order) {
      const shift = 8 * component;
      const [a, b, corner] = [(q >>> shift) & 255, (r >>> shift) & 255, (p >>> shift) & 255];
      const base = 4 * ((i >>> shift) & 255) - a - b - corner;
      const g = median(a, b, corner) - base;
      const z = this.symbols.next(REMAINDER + (g < 0 ? 0 : g < 4 ? 1 : 2));
      const value = base + ((z + Math.min(Math.max(g, 0), 3)) & 3);
      texel |= inByte(value) << shift;
    }
    return texel;
  }

  /**
   * A block by its Haar differences.
   * @param {number} at
   * @param {number} i the mean @param {number} w0 @param {number} w1 @param {number} n0 @param {number} n1
   * @param {number} e means around @param {number} s @param {number} sw @param {number} se
   */
  differences(at, i, w0, w1, n0, n1, e, s, sw, se) {
    const { symbols, components, order } = this;
    const block = [0, 0, 0, 0];
    let [ev, eh, eg] = [0, 0, 0];
    for (let j = 0; j < components; j++) {
      const shift = 8 * order[j];
      const sample = (/** @type {number} */ texel) => (texel >>> shift) & 255;
      const refers = references(components, j) > 0;
      const table = HAAR + (refers ? 30 : 0);
      if (!refers) ev = eh = eg = 0;
      const mean = sample(i);
      const north = sample(n0) + sample(n1) - 2 * mean;
      const west = sample(w0) + sample(w1) - 2 * mean;
      const across = sample(n0) - sample(n1);
      const down = sample(w0) - sample(w1);
      const east = sample(e) - mean;
      const south = sample(s) - mean;
      const tilt = sample(se) - sample(sw);
      const calm = Math.abs(north) + Math.abs(west) + Math.abs(across) + Math.abs(down);
      const residual = (
        /** @type {number} */ kind,
        /** @type {number} */ other,
        /** @type {number} */ reference,
      ) => {
        const own = calm + Math.abs(other);
        const activity = refers ? (own >> 2) + 3 * Math.abs(reference) : own;
        return symbols.residual(table + 10 * kind + classOf(activity));
      };
      const rv = residual(0, south, ev);
      const v = rv + ((88 * north - 50 * south + 176 * down + 220 * ev + 128) >> 8);
      const rh = residual(1, east, eh);
      const h = rh + ((46 * west - 22 * east + 93 * across + 240 * eh + 128) >> 8);
      const rg = residual(2, tilt, eg);
      const g = rg + ((20 * west - 8 * east - 2 * tilt + 47 * h + 235 * eg + 128) >> 8);
      if (j === 0) [ev, eh, eg] = [rv, rh, rg];

      const t = (v + (v & 1)) >> 1;
      const top = 2 * mean + ((h ^ t) & 1) + t;
      const bottom = top - v;
      const p = (top + h) >> 1;
      const d = 2 * g + (bottom & 1);
      const r = (bottom + d) >> 1;
      [p, p - h, r, r - d].forEach((value, k) => (block[k] |= inByte(value) << shift));
    }
    this.put(at, block[0], block[1], block[2], block[3]);
  }

  /** @param {number} at */
  edgeTexel(at) {
    const { texels, width, components, symbols } = this;
    const left = at % width > 0;
    const up = at >= width;
    const w = left ? texels[at - 1] : up ? texels[at - width] : 0;
    const n = up ? texels[at - width] : w;
    const nw = left && up ? texels[at - width - 1] : n;
    const slot = this.slotOf(w, K4, n, K3, nw, K2, 0, 0, 0, 0);
    const seen = this.seen[slot];
    const alike = (w === n ? 1 : 0) + (seen === w || seen === n ? 2 : 0);
    const found = symbols.next(EDGE + alike);
    let texel = [seen, w, n, nw, nw][found];
    if (found >= 5) {
      texel = 0;
      for (let shift = 0; shift < 8 * components; shift += 8) {
        const guess = median((w >>> shift) & 255, (n >>> shift) & 255, (nw >>> shift) & 255);
        texel |= ((guess + symbols.residual(EDGE_SAMPLE)) & 255) << shift;
      }
    }
    return (this.seen[slot] = texel);
  }
}

/** @type {import("../level-decoder.js").Engine["repeats"]} */
export function decodeRepeats(data, below, shape) {
  return new Group(data, below, shape).decode();
}
