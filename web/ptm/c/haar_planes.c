#include "haar.h"

enum { WEIGHT_TOP = 2047, SENT_WEIGHTS = 1, RANKED = 16 };

// In 1/256, for planes with 0, 1, 2 references: V, h, g.
static const i16 built_in[3][3][7] = {
    {{-158, -5, 31, 29, 0, 0, 0}, {-79, 5, 6, -18, 0, 0, 0}, {-22, 10, 44, 44, 10, 0, 0}},
    {{-167, -2, 32, 32, 0, 241, 0}, {-78, 1, 4, -18, 0, 241, 0}, {-19, 10, 47, 49, 9, 235, 0}},
    {{-152, -7, 25, 22, 0, 236, 35}, {-78, 0, 3, -18, 0, 236, 28}, {-19, 9, 46, 46, 10, 228, 70}},
};

Plane planes[MOST_PLANES];
i16 *zeros, *prediction;
u16 *symbols, *rest;

static void read_ranks(Plane *plane, const u8 *bitmap) {
  i32 many = 0;
  for (i32 v = 0; v < 256; v++) {
    if (bitmap[v >> 3] >> (v & 7) & 1) plane->values[many++] = (u8)v;
  }
  plane->top = many - 1;
  for (i32 v = 0, i = 0; v < 256; v++) {
    while (i < plane->top && (plane->values[i] + plane->values[i + 1]) >> 1 < v) i++;
    plane->rank[v] = (u8)i;
  }
}

static i16 *take_row(void) {
  i16 *row = take(sizeof(i16) * (u32)(tile.bw + 2 * MARGIN + 2 * BLOCKS));
  return row ? row + MARGIN : NULL;
}

bool take_rows(void) {
  bool all = (zeros = take_row()) && (rest = (u16 *)take_row()) && (prediction = take_row());
  all = all && (symbols = (u16 *)take_row());
  for (i32 c = 0; c < tile.components; c++) {
    Plane *plane = &planes[c];
    for (i32 i = 0; i < 8; i++) all = all && (plane->rows[i] = take_row());
    for (i32 i = 0; i < 2; i++) {
      all = all && (plane->gradient[i] = take_row());
      for (i32 k = 0; k < 3; k++) {
        all = all && (plane->value[k][i] = take_row()) && (plane->residual[k][i] = take_row());
      }
    }
    all = all && (plane->upper = (u16 *)take_row()) && (plane->lower = (u16 *)take_row());
  }
  return all;
}

bool read_planes(const u8 **data) {
  if (*data == tile.end) return false;
  u32 flags = *(*data)++;
  if (flags & ~(u32)(SENT_WEIGHTS | RANKED * ((1 << tile.components) - 1))) return false;
  const u8 *bitmaps[MOST_PLANES] = {0};
  for (i32 c = 0; c < tile.components; c++) {
    if (!(flags & (u32)RANKED << c)) continue;
    if (tile.end - *data < 32) return false;
    bitmaps[c] = *data;
    *data += 32;
  }
  for (i32 c = 0; c < tile.components; c++) {
    Plane *plane = &planes[c];
    plane->component = component_of(c);
    plane->references = references_of(c);
    plane->top = 0;
    if (bitmaps[plane->component]) {
      read_ranks(plane, bitmaps[plane->component]);
      if (plane->top < 1) return false;
    }
    __builtin_memcpy(plane->weights, built_in[plane->references], sizeof plane->weights);
    if (!(flags & SENT_WEIGHTS)) continue;
    for (i32 k = V; k <= G; k++) {
      for (i32 i = 0; i < 7; i++) {
        bool sent = i < 4 || (i == 4 && k == G) || (i > 4 && i < 5 + plane->references);
        if (sent && tile.end - *data < 2) return false;
        i16 weight = sent ? (i16)word16(*data) : 0;
        *data += sent ? 2 : 0;
        if (magnitude(weight) > WEIGHT_TOP) return false;
        plane->weights[k][i] = weight;
      }
    }
  }
  return true;
}
