// The Haar coder (docs/formats/ptm.md, "Haar coder"), eight blocks at a time.
//
// The predictions of a row of differences, and the tables of its symbols, do not depend on the symbols
// of the row itself. So one pass over a row predicts, one decodes, one computes differences from the
// symbols; once V, h and g of a block row are complete, one computes its texels.
//
// All arithmetic has 16 bits. In a file from an encoder V, h and g lie within ±510; a value beyond ±1024
// is refused in the end, so overflow of arithmetic with it does not matter.

#include <wasm_simd128.h>

#include "haar.h"
#include "rans.h"

enum { CLASSES = 14, EDGE_TABLE = 28, TABLES = 29, PREDICTION_TOP = 1020, ACTIVITY_TOP = 1023,
       DIFFERENCE_TOP = 1024 };

// In 1/64, by the number of references: of the neighbourhood of a block, its activity in sixteenths.
static const i16 activity_weights[3][3][7] = {
    {{154, 139, 0, 0, 0, 0, 0}, {61, 153, 0, 0, 25, 0, 0}, {11, 67, 0, 0, 22, 66, 88}},
    {{9, 98, 36, 0, 0, 0, 0}, {3, 99, 51, 0, 60, 0, 0}, {1, 27, 57, 0, 17, 50, 49}},
    {{8, 74, 31, 128, 0, 0, 0}, {3, 88, 23, 131, 38, 0, 0}, {1, 24, 20, 61, 25, 39, 55}},
};
// By activity, where the table of its class begins.
static u16 offsets[ACTIVITY_TOP + 1];
_Static_assert(CLASSES * sizeof(RowTable) < 1 << 16, "offsets have 16 bits");
static const i16 class_bounds[CLASSES - 1] = {1, 3, 7, 12, 20, 32, 50, 76, 115, 170, 250, 370, 560};

static v128_t stray;

static inline v128_t load(const i16 *from) { return wasm_v128_load(from); }
static inline v128_t absolute(v128_t a) { return wasm_i16x8_abs(a); }
static inline v128_t less(v128_t a, v128_t b) { return wasm_i16x8_sub(a, b); }
static inline v128_t more(v128_t a, v128_t b) { return wasm_i16x8_add(a, b); }

// Two weights side by side, as `summed` takes them.
static inline v128_t both(i16 a, i16 b) {
  return wasm_i32x4_splat((i32)((u32)(u16)a | (u32)(u16)b << 16));
}

// Adds the products of two numbers of each block with two weights to sums of 32 bits.
static inline void summed(v128_t a, v128_t b, v128_t weights, v128_t *low, v128_t *high) {
  v128_t first = wasm_i16x8_shuffle(a, b, 0, 8, 1, 9, 2, 10, 3, 11);
  v128_t second = wasm_i16x8_shuffle(a, b, 4, 12, 5, 13, 6, 14, 7, 15);
  *low = wasm_i32x4_add(*low, wasm_i32x4_dot_i16x8(first, weights));
  *high = wasm_i32x4_add(*high, wasm_i32x4_dot_i16x8(second, weights));
}

// Predictions and activities of a row of difference k, which is a constant where this is called, in
// block row y. Planes without a reference use zeros: to omit them would be three times the
// code, and no faster by more than a twentieth.
static inline __attribute__((always_inline)) void predict(Plane *plane, i32 y, const i32 k) {
  const i32 side = y & 1;
  const i16 *nn = plane->rows[(y - 2) & 7], *n = plane->rows[(y - 1) & 7];
  const i16 *i = plane->rows[y & 7], *s = plane->rows[(y + 1) & 7], *ss = plane->rows[(y + 2) & 7];
  const i16 *gradient = plane->gradient[side], *above = plane->residual[k][1 - side];
  const i16 *v = plane->value[V][side], *ev = plane->residual[V][side];
  const i16 *h = plane->value[H][side], *eh = plane->residual[H][side];
  const i16 *h_under = plane->value[H][1 - side], *eh_under = plane->residual[H][1 - side];
  const i16 *r1 = plane->references > 0 ? planes[0].residual[k][side] : zeros;
  const i16 *r2 = plane->references > 1 ? planes[1].residual[k][side] : zeros;
  const i16 *w = plane->weights[k], *c = activity_weights[plane->references][k];
  i16 *const predicted = prediction;
  u16 *const lively = symbols;
  const i32 bw = tile.bw;
  for (i32 x = 0; x < bw; x += BLOCKS) {
    v128_t e1 = load(r1 + x), e2 = load(r2 + x);
    v128_t low = wasm_i32x4_splat(128), high = low;
    if (k == V) {
      summed(less(load(s + x), load(n + x)),
             more(less(load(s + x - 1), load(n + x - 1)), less(load(s + x + 1), load(n + x + 1))),
             both(w[0], w[1]), &low, &high);
      summed(less(load(ss + x), load(i + x)), less(load(i + x), load(nn + x)), both(w[2], w[3]),
             &low, &high);
    } else {
      const i16 *next = k == H ? n : s;
      summed(less(load(i + x + 1), load(i + x - 1)), less(load(next + x + 1), load(next + x - 1)),
             both(w[0], w[1]), &low, &high);
      v128_t slope = less(load(v + x + 1), load(v + x - 1));
      if (k == H) {
        summed(less(load(s + x + 1), load(s + x - 1)), slope, both(w[2], w[3]), &low, &high);
      } else {
        summed(load(h + x), load(h_under + x), both(w[2], w[3]), &low, &high);
        summed(slope, slope, both(w[4], 0), &low, &high);
      }
    }
    summed(e1, e2, both(w[5], w[6]), &low, &high);
    v128_t p = wasm_i16x8_narrow_i32x4(wasm_i32x4_shr(low, 8), wasm_i32x4_shr(high, 8));
    p = wasm_i16x8_max(p, wasm_i16x8_splat(-PREDICTION_TOP));
    wasm_v128_store(predicted + x, wasm_i16x8_min(p, wasm_i16x8_splat(PREDICTION_TOP)));

    v128_t around = more(absolute(load(above + x - 1)), absolute(load(above + x + 1)));
    v128_t own = absolute(load(above + x));
    low = high = wasm_i32x4_splat(0);
    summed(load(gradient + x), more(around, more(own, own)), both(c[0], c[1]), &low, &high);
    summed(absolute(e1), absolute(e2), both(c[2], c[3]), &low, &high);
    if (k == H) {
      v128_t a = absolute(load(ev + x));
      summed(a, a, both(c[4], 0), &low, &high);
    } else if (k == G) {
      v128_t a = absolute(load(ev + x)), b = absolute(load(eh + x));
      v128_t d = absolute(load(eh_under + x));
      summed(a, b, both(c[4], c[5]), &low, &high);
      summed(d, d, both(c[6], 0), &low, &high);
    }
    v128_t a = wasm_i16x8_narrow_i32x4(wasm_i32x4_shr(low, 6), wasm_i32x4_shr(high, 6));
    wasm_v128_store(lively + x, wasm_u16x8_min(a, wasm_i16x8_splat(ACTIVITY_TOP)));
  }
}

// The next state; the symbol comes in the place of its activity, so that a row has one address.
static inline u32 step(u32 x, const u8 *first, u16 *at, const u8 **word) {
  const u8 *table = first + offsets[*at];
  u32 slot = x & (SUM - 1), z = table[offsetof(RowTable, slots) + slot];
  *at = (u16)z;
  const u16 *interval = (const u16 *)table + 2 * z;
  return renewed(interval[1] * (x >> 11) + slot - interval[0], word);
}

// The symbols of a row in place of their activities: the four states work side by side.
static void decode_row(const RowTable *first) {
  const u8 *const from = (const u8 *)first;
  u16 *at = symbols, *const end = at + tile.bw;
  const u32 lane = stream.count;
  u32 a = stream.state[lane & 3], b = stream.state[(lane + 1) & 3];
  u32 c = stream.state[(lane + 2) & 3], d = stream.state[(lane + 3) & 3];
  const u8 *word = stream.word;
  for (; at + 8 <= end; at += 8) {
    a = step(a, from, at, &word);
    b = step(b, from, at + 1, &word);
    c = step(c, from, at + 2, &word);
    d = step(d, from, at + 3, &word);
    a = step(a, from, at + 4, &word);
    b = step(b, from, at + 5, &word);
    c = step(c, from, at + 6, &word);
    d = step(d, from, at + 7, &word);
  }
  if (at + 4 <= end) {
    a = step(a, from, at, &word);
    b = step(b, from, at + 1, &word);
    c = step(c, from, at + 2, &word);
    d = step(d, from, at + 3, &word);
    at += 4;
  }
  stream.state[lane & 3] = a;
  stream.state[(lane + 1) & 3] = b;
  stream.state[(lane + 2) & 3] = c;
  stream.state[(lane + 3) & 3] = d;
  stream.word = word;
  stream.count += (u32)(at - symbols);
  for (; at < end; at++) *at = (u16)row_symbol((const RowTable *)(from + offsets[*at]));
  // Behind the row are no residuals.
  wasm_v128_store(end, wasm_i16x8_splat(0));
}

// From symbols to residuals and differences.
static void absorb(i16 *residual, i16 *value) {
  const v128_t one = wasm_i16x8_splat(1), escape = wasm_i16x8_splat(ESCAPE);
  u16 *const from = symbols;
  const i16 *const predicted = prediction;
  const i32 bw = tile.bw;
  for (i32 x = 0; x < bw; x += BLOCKS) {
    v128_t z = wasm_v128_load(from + x);
    if (__builtin_expect(wasm_v128_any_true(wasm_i16x8_eq(z, escape)), 0)) {
      for (i32 j = x; j < x + BLOCKS; j++) {
        if (from[j] == ESCAPE) from[j] = (u16)next_escape();
      }
      z = wasm_v128_load(from + x);
    }
    v128_t e = wasm_v128_xor(wasm_u16x8_shr(z, 1), wasm_i16x8_neg(wasm_v128_and(z, one)));
    v128_t sum = more(e, load(predicted + x));
    wasm_v128_store(residual + x, e);
    wasm_v128_store(value + x, sum);
    v128_t raised = more(sum, wasm_i16x8_splat(DIFFERENCE_TOP));
    stray = wasm_v128_or(stray, wasm_v128_and(raised, wasm_i16x8_splat(~(2 * DIFFERENCE_TOP - 1))));
  }
  value[bw] = 0;
}

// Texels of a row of blocks from differences of values.
static void rebuild(Plane *plane, i32 y) {
  const i16 *row = plane->rows[y & 7], *v = plane->value[V][y & 1];
  const i16 *h = plane->value[H][y & 1], *g = plane->value[G][y & 1];
  const v128_t one = wasm_i16x8_splat(1);
  const v128_t places = wasm_i16x8_make(0, 1, 2, 3, 4, 5, 6, 7);
  for (i32 x = 0; x < tile.bw; x += BLOCKS) {
    v128_t mean = load(row + x), vx = load(v + x), hx = load(h + x), gx = load(g + x);
    v128_t t = wasm_i16x8_shr(more(vx, wasm_v128_and(vx, one)), 1);
    v128_t odd = wasm_v128_and(wasm_v128_xor(hx, t), one);
    v128_t top = more(more(mean, mean), more(odd, t));
    v128_t bottom = less(top, vx);
    v128_t p = wasm_i16x8_shr(more(top, hx), 1), q = less(p, hx);
    v128_t d = more(more(gx, gx), wasm_v128_and(bottom, one));
    v128_t r = wasm_i16x8_shr(more(bottom, d), 1), s = less(r, d);
    v128_t all = wasm_v128_or(wasm_v128_or(p, q), wasm_v128_or(r, s));
    // The texels behind the row are undefined.
    v128_t within = wasm_i16x8_lt(places, wasm_i16x8_splat((i16)at_most(tile.bw - x, BLOCKS)));
    all = wasm_v128_and(all, wasm_i16x8_splat(~255));
    stray = wasm_v128_or(stray, wasm_v128_and(all, within));
    wasm_v128_store(plane->upper + x, wasm_v128_or(p, wasm_i16x8_shl(q, 8)));
    wasm_v128_store(plane->lower + x, wasm_v128_or(r, wasm_i16x8_shl(s, 8)));
  }
}

// The same of differences of ranks. They fix the four ranks up to a common shift u, with which the
// sum of the values grows: one of them has the mean.
static void rebuild_ranked(Plane *plane, i32 y) {
  const u32 *below = tile.below + y * tile.bw;
  const u8 *values = plane->values;
  for (i32 x = 0; x < tile.bw; x++) {
    i32 v = plane->value[V][y & 1][x], h = plane->value[H][y & 1][x];
    i32 mean = (i32)(below[x] >> 8 * plane->component & 255);
    i32 d = 2 * plane->value[G][y & 1][x] + ((v ^ h) & 1), a = (d + v + h) >> 1, b = a - h;
    i32 lowest = a < b ? a : b, highest = a < b ? b : a;
    i32 least = at_least(-at_most(lowest, d), 0);
    i32 most = plane->top - at_least(at_least(highest, d), 0);
    if (least > most) {
      stream.stray = true;
      return;
    }
    i32 u = plane->rank[mean] - ((a + b + d + 2) >> 2);
    u = at_most(at_least(u, least), most);
    i32 excess = values[u] + values[u + a] + values[u + b] + values[u + d] - 4 * mean;
    for (i32 by = excess < 0 ? 1 : -1; excess >> 2 && u + by >= least && u + by <= most;) {
      u += by;
      excess = values[u] + values[u + a] + values[u + b] + values[u + d] - 4 * mean;
    }
    stream.stray |= excess >> 2 != 0;
    plane->upper[x] = (u16)(values[u + a] | values[u + b] << 8);
    plane->lower[x] = (u16)(values[u + d] | values[u] << 8);
  }
}

// Sixteen texels at a time from their components. Texels behind the row are written later.
static void write_row(u32 *out, const u16 *const rows[MOST_PLANES]) {
  for (i32 x = 0; x < tile.bw; x += BLOCKS, out += 2 * BLOCKS) {
    v128_t a = wasm_v128_load(rows[0] + x), b = wasm_v128_load(rows[1] + x);
    v128_t c = wasm_v128_load(rows[2] + x), d = wasm_v128_load(rows[3] + x);
    v128_t ab = wasm_i8x16_shuffle(a, b, 0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
    v128_t cd = wasm_i8x16_shuffle(c, d, 0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
    wasm_v128_store(out, wasm_i16x8_shuffle(ab, cd, 0, 8, 1, 9, 2, 10, 3, 11));
    wasm_v128_store(out + 4, wasm_i16x8_shuffle(ab, cd, 4, 12, 5, 13, 6, 14, 7, 15));
    ab = wasm_i8x16_shuffle(a, b, 8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31);
    cd = wasm_i8x16_shuffle(c, d, 8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31);
    wasm_v128_store(out + 8, wasm_i16x8_shuffle(ab, cd, 0, 8, 1, 9, 2, 10, 3, 11));
    wasm_v128_store(out + 12, wasm_i16x8_shuffle(ab, cd, 4, 12, 5, 13, 6, 14, 7, 15));
  }
}

// Ranks of a row of the level below; it and both its ends are repeated outwards.
static __attribute__((noinline)) void load_row(Plane *plane, i32 y) {
  i16 *row = plane->rows[y & 7];
  const u32 *below = tile.below + tile.bw * at_most(at_least(y, 0), tile.bh - 1);
  const u32 shift = 8 * (u32)plane->component;
  if (plane->top) {
    for (i32 x = 0; x < tile.bw; x++) row[x] = plane->rank[below[x] >> shift & 255];
  } else {
    const v128_t byte = wasm_i32x4_splat(255);
    for (i32 x = 0; x < tile.bw; x += BLOCKS) {
      v128_t a = wasm_v128_and(wasm_u32x4_shr(wasm_v128_load(below + x), shift), byte);
      v128_t b = wasm_v128_and(wasm_u32x4_shr(wasm_v128_load(below + x + 4), shift), byte);
      wasm_v128_store(row + x, wasm_i16x8_narrow_i32x4(a, b));
    }
  }
  row[-1] = row[-2] = row[0];
  row[tile.bw] = row[tile.bw + 1] = row[tile.bw - 1];
}

static void fill_gradient(Plane *plane, i32 y) {
  const i16 *n = plane->rows[(y - 1) & 7], *i = plane->rows[y & 7], *s = plane->rows[(y + 1) & 7];
  for (i32 x = 0; x < tile.bw; x += BLOCKS) {
    v128_t across = absolute(less(load(i + x + 1), load(i + x - 1)));
    v128_t down = absolute(less(load(s + x), load(n + x)));
    wasm_v128_store(plane->gradient[y & 1] + x, more(across, down));
  }
}

static void decode_edge(void) {
  i32 count = edge_count();
  for (i32 i = 0; i < count; i++) {
    i32 place = edge_place(i);
    Around a = around_edge(place);
    u32 texel = opaque();
    for (u32 at = 0; at < 8 * (u32)tile.components; at += 8) {
      i32 guess = median(a.w >> at & 255, a.n >> at & 255, a.nw >> at & 255);
      texel |= ((u32)(guess + signed_of(row_symbol(&row_tables[EDGE_TABLE]))) & 255) << at;
    }
    tile.texels[place] = texel;
  }
}

// Block row y of a plane, and g of the row before it.
static bool decode_plane(Plane *plane, i32 y) {
  const i32 now = y & 1;
  if (y < tile.bh) {
    load_row(plane, y + 2);
    fill_gradient(plane, y);
  } else {
    u32 size = sizeof(i16) * (u32)tile.bw;
    __builtin_memcpy(plane->value[H][now], plane->value[H][1 - now], size);
    __builtin_memset(plane->residual[H][now], 0, size);
  }
  for (i32 k = V; k <= G; k++) {
    i32 row = k == G ? y - 1 : y;
    if (row < 0 || row == tile.bh) continue;
    if (k == V) {
      predict(plane, row, V);
    } else if (k == H) {
      predict(plane, row, H);
    } else {
      predict(plane, row, G);
    }
    decode_row(row_tables + (k == G ? CLASSES : 0));
    if (stream.word > stream.end) return false;
    absorb(plane->residual[k][row & 1], plane->value[k][row & 1]);
  }
  if (y == 0) return true;
  if (plane->top) {
    rebuild_ranked(plane, y - 1);
  } else {
    rebuild(plane, y - 1);
  }
  return !stream.stray && !wasm_v128_any_true(stray);
}

int decode_haar(void) {
  for (i32 a = 0; a <= ACTIVITY_TOP && !offsets[ACTIVITY_TOP]; a++) {
    for (u32 i = 0; i < CLASSES - 1; i++) {
      offsets[a] += class_bounds[i] <= a ? (u16)sizeof(RowTable) : 0;
    }
  }
  const u8 *data = tile.data;
  if (!take_rows()) return NO_MEMORY;
  if (!read_planes(&data) || !read_tables(&data, TABLES, geometric, 34, true)) return DAMAGED;
  if (!begin_stream(data)) return DAMAGED;
  stray = wasm_i16x8_splat(0);
  const u16 *upper[MOST_PLANES], *lower[MOST_PLANES];
  __builtin_memset(rest, opaque() ? 255 : 0, sizeof(i16) * (u32)tile.bw);
  for (i32 c = 0; c < MOST_PLANES; c++) upper[c] = lower[c] = rest;
  for (i32 c = 0; c < tile.components; c++) {
    upper[planes[c].component] = planes[c].upper;
    lower[planes[c].component] = planes[c].lower;
    for (i32 y = -2; y < 2 && tile.bw && tile.bh; y++) load_row(&planes[c], y);
  }
  for (i32 y = 0; y <= tile.bh && tile.bw && tile.bh; y++) {
    for (i32 c = 0; c < tile.components; c++) {
      if (!decode_plane(&planes[c], y)) return DAMAGED;
    }
    if (y == 0) continue;
    u32 *row = tile.texels + (2 * y - 2) * tile.width;
    write_row(row, upper);
    write_row(row + tile.width, lower);
  }
  decode_edge();
  return end_stream() ? OK : DAMAGED;
}
