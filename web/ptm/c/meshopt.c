// The codecs of EXT_meshopt_compression that cells use (docs/formats/gltf.md): attributes of version 0,
// with the filter EXPONENTIAL or none, and triangles of version 1.

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
      for (i32 i = 0; i < GROUP; i++) delta[i] = bits ? at[i] : 0;
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

// Decodes elements of a stride that is a multiple of 4, at most 256.
int decode_attributes(const u8 *at, const u8 *end, i32 count, i32 stride, u8 *out) {
  i32 tail = at_least(TAIL, stride), block = at_most(BLOCK_BYTES / stride & ~(GROUP - 1), BLOCK);
  if (end - at < 1 + tail || *at++ != 0xa0) return DAMAGED;
  const u8 *before = end - stride;
  end -= tail;
  u8 delta[BLOCK];
  for (i32 first = 0; first < count; first += block) {
    i32 n = at_most(block, count - first);
    for (i32 byte = 0; byte < stride; byte++) {
      at = deltas(at, end, (n + GROUP - 1) / GROUP, delta);
      if (!at) return DAMAGED;
      u8 value = before[byte], *to = out + byte;
      for (i32 i = 0; i < n; i++, to += stride) {
        value = (u8)(value + ((delta[i] >> 1) ^ -(delta[i] & 1)));
        *to = value;
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
