// The codecs of EXT_meshopt_compression that cells use (docs/formats/gltf.md): attributes of version 0,
// with the filter EXPONENTIAL or none, and triangles of version 1.

#include <wasm_simd128.h>

#include "memory.h"

enum { BLOCK = 256, GROUP = 16, BLOCK_BYTES = 8192, TAIL = 32, TABLE = 16, RECENT = 16 };

// Reads the deltas of one byte of up to 256 elements; NULL if the data are cut short.
static const u8 *deltas(const u8 *at, const u8 *end, i32 groups, u8 *delta) {
  const u8 *modes = at;
  at += (groups + 3) / 4;
  if (at > end) return NULL;
  for (i32 group = 0; group < groups; group++, delta += GROUP) {
    i32 mode = modes[group / 4] >> (2 * (group % 4)) & 3, bits = mode ? 1 << mode : 0;
    if (2 * bits > end - at) return NULL;
    if (bits == 0 || bits == 8) {
      wasm_v128_store(delta, bits ? wasm_v128_load(at) : wasm_i32x4_const_splat(0));
      at += 2 * bits;
      continue;
    }
    const u8 *more = at + 2 * bits;
    i32 sentinel = (1 << bits) - 1;
    for (i32 i = 0; i < GROUP; i++) {
      i32 place = i * bits, value = at[place / 8] >> (8 - bits - place % 8) & sentinel;
      if (value == sentinel) {
        if (more >= end) return NULL;
        value = *more++;
      }
      delta[i] = (u8)value;
    }
    at = more;
  }
  return at;
}

// Sixteen deltas of a byte of elements: even ones go up, odd ones down.
static v128_t steps(const u8 *at) {
  v128_t delta = wasm_v128_load(at), odd = wasm_v128_and(delta, wasm_i8x16_const_splat(1));
  return wasm_v128_xor(wasm_u8x16_shr(delta, 1), wasm_i8x16_neg(odd));
}

// Adds the deltas of four bytes of 4 elements to `last`, the element before in each lane of 32 bits.
static v128_t add_up(v128_t sum, v128_t last, i32 stride, u8 *out) {
  v128_t zero = wasm_i32x4_const_splat(0);
  sum = wasm_i8x16_add(sum, wasm_i32x4_shuffle(zero, sum, 0, 4, 5, 6));
  sum = wasm_i8x16_add(sum, wasm_i32x4_shuffle(zero, sum, 0, 1, 4, 5));
  sum = wasm_i8x16_add(sum, last);
  wasm_v128_store32_lane(out, sum, 0);
  wasm_v128_store32_lane(out + stride, sum, 1);
  wasm_v128_store32_lane(out + 2 * stride, sum, 2);
  wasm_v128_store32_lane(out + 3 * stride, sum, 3);
  return wasm_i32x4_shuffle(sum, sum, 3, 3, 3, 3);
}

// The same of 16 elements, whose bytes come one after the other.
static v128_t add_group(const u8 *delta, v128_t last, i32 stride, u8 *out) {
  v128_t a = steps(delta), b = steps(delta + BLOCK);
  v128_t c = steps(delta + 2 * BLOCK), d = steps(delta + 3 * BLOCK);
  v128_t ab = wasm_i8x16_shuffle(a, b, 0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
  v128_t cd = wasm_i8x16_shuffle(c, d, 0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
  last = add_up(wasm_i16x8_shuffle(ab, cd, 0, 8, 1, 9, 2, 10, 3, 11), last, stride, out);
  out += 4 * stride;
  last = add_up(wasm_i16x8_shuffle(ab, cd, 4, 12, 5, 13, 6, 14, 7, 15), last, stride, out);
  out += 4 * stride;
  ab = wasm_i8x16_shuffle(a, b, 8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31);
  cd = wasm_i8x16_shuffle(c, d, 8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31);
  last = add_up(wasm_i16x8_shuffle(ab, cd, 0, 8, 1, 9, 2, 10, 3, 11), last, stride, out);
  out += 4 * stride;
  return add_up(wasm_i16x8_shuffle(ab, cd, 4, 12, 5, 13, 6, 14, 7, 15), last, stride, out);
}

// Decodes elements of a stride that is a multiple of 4, at most 256. Behind them is room for 15 more.
int decode_attributes(const u8 *at, const u8 *end, i32 count, i32 stride, u8 *out) {
  i32 tail = at_least(TAIL, stride), block = at_most(BLOCK_BYTES / stride & ~(GROUP - 1), BLOCK);
  if (end - at < 1 + tail || *at++ != 0xa0) return DAMAGED;
  const u8 *before = end - stride;
  end -= tail;
  u8 delta[4 * BLOCK];
  for (i32 first = 0; first < count; first += block) {
    i32 n = at_most(block, count - first), groups = (n + GROUP - 1) / GROUP;
    for (i32 channel = 0; channel < stride; channel += 4) {
      for (i32 byte = 0; byte < 4; byte++) {
        at = deltas(at, end, groups, delta + byte * BLOCK);
        if (!at) return DAMAGED;
      }
      v128_t last = wasm_v128_load32_splat(before + channel);
      for (i32 from = 0; from < n; from += GROUP) {
        last = add_group(delta + from, last, stride, out + channel + from * stride);
      }
    }
    out += n * stride;
    before = out - stride;
  }
  return at == end ? OK : DAMAGED;
}

// Turns numbers of an exponent of 8 bits and a mantissa of 24 into floats, in place.
void filter_exponential(u32 *number, i32 count) {
  for (i32 i = 0; i < count; i++) {
    i32 bits = (i32)number[i], exponent = bits >> 24;
    // A power of two in two factors, of which neither leaves the exponents of float.
    u32 half = (u32)((exponent >> 1) + 127) << 23, rest = (u32)(exponent - (exponent >> 1) + 127) << 23;
    float a, b, value;
    __builtin_memcpy(&a, &half, sizeof a);
    __builtin_memcpy(&b, &rest, sizeof b);
    value = (float)((i32)((u32)bits << 8) >> 8) * a * b;
    __builtin_memcpy(&number[i], &value, sizeof value);
  }
}

// The state of the triangles' decoder: recent edges and vertices and their numbers, the next new vertex,
// the last explicit one, and the next byte of explicit ones.
typedef struct {
  u32 edge[RECENT][2], vertex[RECENT], edges, vertices, next, last;
  const u8 *at, *end;
} Mesh;

static void remember(Mesh *m, u32 value) { m->vertex[m->vertices++ % RECENT] = value; }

static void join(Mesh *m, u32 a, u32 b) {
  u32 *edge = m->edge[m->edges++ % RECENT];
  edge[0] = a;
  edge[1] = b;
}

// An explicit vertex: LEB128 of the difference from the last one. Past the end it reads zeros.
static u32 explicit_vertex(Mesh *m) {
  u32 value = 0;
  for (i32 shift = 0; shift < 35; shift += 7) {
    u32 byte = m->at < m->end ? *m->at : 0;
    m->at++;
    value |= (byte & 0x7f) << shift;
    if (byte < 0x80) break;
  }
  m->last += (value >> 1) ^ -(value & 1);
  return m->last;
}

// A second or third corner by its code.
static u32 corner(Mesh *m, u32 code) {
  if (code == 0) return m->next++;
  return code < 15 ? m->vertex[(m->vertices - code) % RECENT] : explicit_vertex(m);
}

// Decodes the corners of triangles; a corner that is not below `vertices` is damaged.
int decode_triangles(const u8 *at, const u8 *end, i32 count, u32 vertices, u32 *out) {
  i32 triangles = count / 3;
  if (end - at < 1 + triangles + TABLE || *at++ != 0xe1 || count % 3) return DAMAGED;
  const u8 *table = end - TABLE;
  Mesh m = {.at = at + triangles, .end = table};
  for (i32 t = 0; t < triangles; t++, out += 3) {
    u32 code = at[t], high = code >> 4, low = code & 15, a, b, c;
    if (high < 15) {
      const u32 *edge = m.edge[(m.edges - 1 - high) % RECENT];
      a = edge[0];
      b = edge[1];
      if (low == 13 || low == 14) c = m.last += 2 * low - 27;
      else if (low && low < 13) c = m.vertex[(m.vertices - 1 - low) % RECENT];
      else c = low ? explicit_vertex(&m) : m.next++;
      if (!low || low > 12) remember(&m, c);
    } else {
      u32 pair = table[low];
      if (low >= 14) {
        if (m.at >= m.end) return DAMAGED;
        pair = *m.at++;
        if (!pair) m.next = 0;
      }
      a = low == 15 ? explicit_vertex(&m) : m.next++;
      u32 second = pair >> 4, third = pair & 15;
      b = corner(&m, second);
      c = corner(&m, third);
      remember(&m, a);
      if (second % 15 == 0) remember(&m, b);
      if (third % 15 == 0) remember(&m, c);
      join(&m, b, a);
    }
    join(&m, c, b);
    join(&m, a, c);
    if (a >= vertices || b >= vertices || c >= vertices) return DAMAGED;
    out[0] = a;
    out[1] = b;
    out[2] = c;
  }
  return m.at == m.end ? OK : DAMAGED;
}
