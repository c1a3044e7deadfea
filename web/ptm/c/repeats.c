// The repeats coder (docs/formats/ptm.md, "Repeats coder"): blocks and texels that repeat.

#include "rans.h"

// First table of each sort of symbol.
enum { GUESS = 12, TEXEL = 24, LAST = 60, EDGE = 72, EDGE_SAMPLE = 84, HAAR = 85, SAMPLE = 145,
       REMAINDER = 185, RUN = 188, TABLES = 196 };
enum { LONGEST_RUN = 254, TEXELS = 3, MOST_BITS = 13, CLASSES = 10 };

static const u32 K0 = 0x9e3779b1, K1 = 0x85ebca6b, K2 = 0xc2b2ae35;
static const u32 K3 = 0x27d4eb2f, K4 = 0x165667b1, K5 = 0xa24baed5;

// The last entry of each slot: a block as its place and 1, 0 for none; in FIRST as its place
// << 2 | trust; in SEEN a texel. Of a change the mean of the block, too.
enum { FIRST, AROUND, MEAN, SEEN, SORTS };
static u32 slots[SORTS][1 << MOST_BITS];
static struct {
  u32 place, mean;
} changes[1 << MOST_BITS];
static u32 shift_of_slots;

static inline u32 slot_of(u32 key) { return (key ^ key >> 15) * K1 >> shift_of_slots; }

// a - b and a + b, byte by byte.
static inline u32 minus(u32 a, u32 b) {
  return ((a | 0x80808080) - (b & 0x7f7f7f7f)) ^ ((a ^ b ^ 0x80808080) & 0x80808080);
}
static inline u32 plus(u32 a, u32 b) {
  return ((a & 0x7f7f7f7f) + (b & 0x7f7f7f7f)) ^ ((a ^ b) & 0x80808080);
}

static inline i32 sample(u32 texel, u32 at) { return (i32)(texel >> at & 255); }

static inline i32 residual(u32 table) { return signed_of(symbol(table)); }

// The number of bounds 2, 4, 8 … 512 that are not above an activity.
static inline u32 class_of(i32 activity) {
  return (u32)at_most(31 - __builtin_clz((u32)activity | 1), CLASSES - 1);
}

static inline void put(u32 *here, u32 p, u32 q, u32 r, u32 s) {
  here[0] = p;
  here[1] = q;
  here[tile.width] = r;
  here[tile.width + 1] = s;
}

static inline void copy(u32 *here, u32 place) {
  const u32 *from = tile.texels + place;
  put(here, from[0], from[1], from[tile.width], from[tile.width + 1]);
}

// Whether p q r s have that mean in every component.
static inline bool fits(u32 mean, u32 p, u32 q, u32 r, u32 s) {
  const u32 even = 0x00ff00ff;
  u32 low = (p & even) + (q & even) + (r & even) + (s & even);
  u32 high = (p >> 8 & even) + (q >> 8 & even) + (r >> 8 & even) + (s >> 8 & even);
  return ((low >> 2 & even) | (high >> 2 & even) << 8) == mean;
}

static inline u32 in_byte(i32 value) {
  stream.stray |= (value & ~255) != 0;
  return (u32)value & 255;
}

// The neighbourhood of a block: two texels to the west, two above, the corners above.
typedef struct {
  u32 mean, w0, w1, n0, n1, nw, ne;
} Block;

// The slots of the texels of a block in `seen`.
static inline u32 slot_p(const Block *b) {
  return slot_of(b->mean * K0 + b->w0 * K2 + b->n0 * K3 + b->nw * K4 + b->n1 * K5);
}
static inline u32 slot_q(const Block *b, u32 p) {
  return slot_of(b->mean * K1 + p * K2 + b->n1 * K3 + b->n0 * K4 + b->ne * K5);
}
static inline u32 slot_r(const Block *b, u32 p, u32 q) {
  return slot_of(b->mean * K2 + b->w1 * K3 + p * K4 + b->w0 * K5 + q * K0);
}
static inline u32 slot_s(const Block *b, u32 p, u32 q, u32 r) {
  return slot_of(b->mean * K3 + p * K4 + q * K5 + r * K0);
}

// A texel of new samples, each predicted from W, N, NW, NE.
static u32 new_texel(u32 position, u32 mean, u32 w, u32 n, u32 nw, u32 ne) {
  static const i16 weights[3][4] = {{20, 24, -10, -7}, {2, 27, -12, -2}, {13, -7, -6, -39}};
  const i16 *k = weights[position];
  u32 texel = 0;
  i32 reference = 0;
  for (i32 j = 0; j < tile.components; j++) {
    u32 at = 8 * (u32)component_of(j);
    i32 i = sample(mean, at), fw = sample(w, at) - i, fn = sample(n, at) - i;
    i32 fnw = sample(nw, at) - i, fne = sample(ne, at) - i;
    i32 guess = i + ((k[0] * fw + k[1] * fn + k[2] * fnw + k[3] * fne + 32) >> 6);
    i32 activity = magnitude(fw - fn) + magnitude(fn - fne) + magnitude(fw) + magnitude(fn);
    u32 table = SAMPLE + (position ? CLASSES : 0);
    if (references_of(j)) {
      guess += reference;
      activity = (activity >> 2) + 4 * magnitude(reference);
      table += 2 * CLASSES;
    }
    guess = at_most(at_least(guess, 0), 255);
    i32 value = (guess + residual(table + class_of(activity))) & 255;
    if (j == 0) reference = value - guess;
    if (j == 1) reference += (value - guess) >> 1;
    texel |= (u32)value << at;
  }
  return texel;
}

// p, q or r of a block: a neighbouring texel, or a new one.
static inline u32 texel_of(u32 position, u32 table, u32 seen, u32 mean, u32 w, u32 n, u32 nw,
                           u32 ne) {
  table += 12 * position + (w == n) + 2 * ((seen == w) | (seen == n));
  // By index: a switch would be guessed wrong for most texels.
  const u32 known[5] = {seen, w, n, nw, ne};
  u32 z = symbol_here(table);
  return z < 5 ? known[z] : new_texel(position, mean, w, n, nw, ne);
}

// s of a block by the remainder of the sum.
static u32 by_remainder(u32 mean, u32 p, u32 q, u32 r) {
  u32 texel = 0;
  for (i32 j = 0; j < tile.components; j++) {
    u32 at = 8 * (u32)component_of(j);
    i32 a = sample(q, at), b = sample(r, at), corner = sample(p, at);
    i32 base = 4 * sample(mean, at) - a - b - corner;
    i32 guess = median(a, b, corner) - base;
    i32 z = (i32)symbol(REMAINDER + (guess < 0 ? 0 : guess < 4 ? 1 : 2));
    texel |= in_byte(base + ((z + at_most(at_least(guess, 0), 3)) & 3)) << at;
  }
  return texel;
}

static void texel_by_texel(u32 *here, const Block *b, u32 near) {
  u32 table = TEXEL + 4 * near, *seen = slots[SEEN];
  u32 at_p = slot_p(b);
  u32 p = texel_of(0, table, seen[at_p], b->mean, b->w0, b->n0, b->nw, b->n1);
  u32 at_q = slot_q(b, p);
  u32 q = texel_of(1, table, seen[at_q], b->mean, p, b->n1, b->n0, b->ne);
  u32 at_r = slot_r(b, p, q);
  u32 r = texel_of(2, table, seen[at_r], b->mean, b->w1, p, b->w0, q);
  u32 at_s = slot_s(b, p, q, r);
  u32 candidates[5] = {seen[at_s], r, q, p, b->w1}, choices[5], many = 0;
  for (u32 i = 0; i < 5; i++) {
    bool fresh = fits(b->mean, p, q, r, candidates[i]);
    for (u32 j = 0; j < i; j++) fresh &= candidates[j] != candidates[i];
    choices[many] = candidates[i];
    many += fresh;
  }
  u32 place = many ? symbol(LAST + 4 * near + (many < 4 ? many - 1 : 3)) : 0;
  u32 s = place < many ? choices[place] : by_remainder(b->mean, p, q, r);
  put(here, p, q, r, s);
  seen[at_p] = p;
  seen[at_q] = q;
  seen[at_r] = r;
  seen[at_s] = s;
}

static void by_differences(u32 *here, const Block *b, u32 e, u32 s, u32 sw, u32 se) {
  u32 block[4] = {0, 0, 0, 0};
  i32 ev = 0, eh = 0, eg = 0;
  for (i32 j = 0; j < tile.components; j++) {
    u32 at = 8 * (u32)component_of(j), table = HAAR;
    i32 i = sample(b->mean, at);
    i32 w0 = sample(b->w0, at), w1 = sample(b->w1, at);
    i32 n0 = sample(b->n0, at), n1 = sample(b->n1, at);
    i32 north = n0 + n1 - 2 * i, west = w0 + w1 - 2 * i, across = n0 - n1, down = w0 - w1;
    i32 east = sample(e, at) - i, south = sample(s, at) - i;
    i32 tilt = sample(se, at) - sample(sw, at);
    i32 calm = magnitude(north) + magnitude(west) + magnitude(across) + magnitude(down);
    i32 av = calm + magnitude(south), ah = calm + magnitude(east), ag = calm + magnitude(tilt);
    if (references_of(j)) {
      table += 3 * CLASSES;
      av = (av >> 2) + 3 * magnitude(ev);
      ah = (ah >> 2) + 3 * magnitude(eh);
      ag = (ag >> 2) + 3 * magnitude(eg);
    } else {
      ev = eh = eg = 0;
    }
    i32 rv = residual(table + class_of(av));
    i32 v = rv + ((88 * north - 50 * south + 176 * down + 220 * ev + 128) >> 8);
    i32 rh = residual(table + CLASSES + class_of(ah));
    i32 h = rh + ((46 * west - 22 * east + 93 * across + 240 * eh + 128) >> 8);
    i32 rg = residual(table + 2 * CLASSES + class_of(ag));
    i32 g = rg + ((20 * west - 8 * east - 2 * tilt + 47 * h + 235 * eg + 128) >> 8);
    if (j == 0) {
      ev = rv;
      eh = rh;
      eg = rg;
    }
    i32 t = (v + (v & 1)) >> 1;
    i32 top = 2 * i + ((h ^ t) & 1) + t, bottom = top - v;
    i32 p = (top + h) >> 1, d = 2 * g + (bottom & 1), r = (bottom + d) >> 1;
    block[0] |= in_byte(p) << at;
    block[1] |= in_byte(p - h) << at;
    block[2] |= in_byte(r) << at;
    block[3] |= in_byte(r - d) << at;
  }
  put(here, block[0], block[1], block[2], block[3]);
  u32 p = block[0], q = block[1], r = block[2];
  u32 at_p = slot_p(b), at_q = slot_q(b, p), at_r = slot_r(b, p, q), at_s = slot_s(b, p, q, r);
  slots[SEEN][at_p] = p;
  slots[SEEN][at_q] = q;
  slots[SEEN][at_r] = r;
  slots[SEEN][at_s] = block[3];
}

// Decodes a block; returns whether it is not a copy of a whole block.
static u32 decode_block(i32 y, i32 x, u32 near) {
  i32 width = tile.width, bw = tile.bw;
  u32 place = (u32)(2 * (y * width + x));
  u32 *here = tile.texels + place;
  const u32 *up = here - width;
  const u32 *below = tile.below + y * bw + x;
  Block b;
  u32 i = b.mean = *below;
  b.w0 = x ? here[-1] : i;
  b.w1 = x ? here[width - 1] : i;
  b.n0 = y ? up[0] : i;
  b.n1 = y ? up[1] : i;

  u32 first = slot_of(i * K0 + b.n0 * K2 + b.n1 * K3 + b.w0 * K4 + b.w1 * K5);
  u32 entry = slots[FIRST][first], trust = entry & 3;
  if (symbol_here(3 * trust + near) == 0) {
    if (trust == 0) {
      slots[FIRST][first] = place << 2 | 1;
      put(here, i, i, i, i);
    } else {
      if (trust < 3) slots[FIRST][first] = entry + 1;
      copy(here, entry >> 2);
    }
    return 0;
  }
  slots[FIRST][first] = place << 2 | 1;

  i32 west = x ? -1 : 0, east = x + 1 < bw ? 1 : 0;
  const u32 *north = y ? below - bw : below, *south = y + 1 < tile.bh ? below + bw : below;
  u32 e = below[east], s = south[0], sw = south[west], se = south[east];
  u32 around = slot_of(i * K0 + e * K1 + s * K2 + north[0] * K3 + below[west] * K4 +
                       (se ^ 0x55) * K5 + 3 * (sw * K1 + north[east] * K4) + 5 * north[west]);
  u32 mean = slot_of(i * K0);
  u32 change = slot_of(minus(b.n0, i) * K0 + minus(b.n1, i) * K2 + minus(b.w0, i) * K3 +
                       minus(b.w1, i) * K4 + minus(e, i) * K5 + minus(s, i) * K1);
  u32 places[3] = {slots[AROUND][around], slots[MEAN][mean], changes[change].place};
  u32 by = minus(i, changes[change].mean);
  u32 guess = symbol_here(GUESS + 4 * near + (places[0] > 0) + 2 * (places[1] > 0));
  slots[AROUND][around] = slots[MEAN][mean] = changes[change].place = place + 1;
  changes[change].mean = i;
  if (guess < TEXELS) {
    if (places[guess] == 0) {
      put(here, i, i, i, i);
    } else if (guess < 2) {
      copy(here, places[guess] - 1);
    } else {
      const u32 *from = tile.texels + places[2] - 1;
      u32 p = plus(from[0], by), q = plus(from[1], by);
      put(here, p, q, plus(from[width], by), plus(from[width + 1], by));
    }
    return 0;
  }
  b.nw = !y ? b.w0 : x ? up[-1] : b.n0;
  b.ne = !y ? i : east ? up[2] : b.n1;
  if (guess == TEXELS) {
    texel_by_texel(here, &b, near);
  } else {
    by_differences(here, &b, e, s, sw, se);
  }
  return 1;
}

// The number of blocks from here on that are flat if they equal their surroundings.
static u32 run_of(i32 y, i32 x) {
  const u32 *here = tile.texels + 2 * (y * tile.width + x);
  const u32 *above = here - tile.width, *below = tile.below + y * tile.bw + x;
  u32 mean = *below;
  if (y == 0 || above[0] != mean || above[1] != mean) return 0;
  if (x && (here[-1] != mean || here[tile.width - 1] != mean)) return 0;
  u32 many = 1, most = (u32)at_most(LONGEST_RUN, tile.bw - x);
  while (many < most && below[many] == mean && above[2 * many] == mean &&
         above[2 * many + 1] == mean) {
    many++;
  }
  return many;
}

static void decode_edge(void) {
  i32 count = edge_count();
  for (i32 i = 0; i < count && stream.word <= stream.end; i++) {
    i32 place = edge_place(i);
    Around a = around_edge(place);
    u32 slot = slot_of(a.w * K4 + a.n * K3 + a.nw * K2), seen = slots[SEEN][slot], texel = 0;
    u32 choice = symbol(EDGE + (a.w == a.n) + 2 * ((seen == a.w) | (seen == a.n)));
    if (choice < 5) {
      texel = choice == 0 ? seen : choice == 1 ? a.w : choice == 2 ? a.n : a.nw;
    } else {
      for (u32 at = 0; at < 8 * (u32)tile.components; at += 8) {
        i32 guess = median(sample(a.w, at), sample(a.n, at), sample(a.nw, at));
        texel |= ((u32)(guess + residual(EDGE_SAMPLE)) & 255) << at;
      }
    }
    tile.texels[place] = slots[SEEN][slot] = texel;
  }
}

int decode_repeats(void) {
  u8 *missed = take((u32)tile.bw + 1);
  if (!missed) return NO_MEMORY;
  const u8 *data = tile.data;
  if (!read_tables(&data, TABLES, geometric, 34, false) || !begin_stream(data)) return DAMAGED;
  u32 blocks = (u32)(tile.bw * tile.bh);
  u32 bits = blocks ? 32 - (u32)__builtin_clz(blocks) : 0;
  bits = (u32)at_most(at_least((i32)bits, 6), MOST_BITS);
  shift_of_slots = 32 - bits;
  const u32 mask = ~opaque();
  for (u32 i = 0; i < blocks; i++) tile.below[i] &= mask;
  for (u32 i = 0; i < SORTS; i++) __builtin_memset(slots[i], 0, sizeof(u32) << bits);
  __builtin_memset(changes, 0, sizeof *changes << bits);
  for (i32 y = 0; y < tile.bh; y++) {
    u32 before = 0;
    bool ended = false;
    for (i32 x = 0; x < tile.bw;) {
      // A block takes up to 24 symbols: words behind the end may be read.
      if (stream.word > stream.end || stream.stray) return DAMAGED;
      u32 run = ended ? 0 : run_of(y, x), flat = 0;
      if (run) {
        u32 rest = symbol(RUN + 31 - (u32)__builtin_clz(run));
        if (rest > run) return DAMAGED;
        flat = run - rest;
        u32 mean = tile.below[y * tile.bw + x];
        u32 *here = tile.texels + 2 * (y * tile.width + x);
        for (u32 i = 0; i < flat; i++) put(here + 2 * i, mean, mean, mean, mean);
      }
      ended = flat < run;
      if (flat) {
        __builtin_memset(missed + x, 0, flat);
        before = 0;
        x += (i32)flat;
        continue;
      }
      ended = false;
      before = missed[x] = (u8)decode_block(y, x, before + missed[x]);
      x++;
    }
  }
  decode_edge();
  for (i32 i = 0; i < tile.width * tile.height; i++) tile.texels[i] |= ~mask;
  return end_stream() ? OK : DAMAGED;
}
