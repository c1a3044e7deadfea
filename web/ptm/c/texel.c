// The texel coder for bytes within an error (docs/formats/ptm-kinds.md, "The texel coder"): numbers
// are values, and no fourth texel follows from the others.

#include "rans.h"

enum { CODED = 2, CODED_WITH_WEIGHTS = 3, WINDOW_TOP = 40, WEIGHT_SUM = 32767, TABLES = 236,
       CLASSES = 18, DIRECT = 16, PLAIN_TOP = 30, FEATURES = 10, WEIGHTS = 12, MOST_PLANES = 4 };
// Texels of a frame: above and left, below and right.
enum { BEFORE = 2, BEHIND = 3 };

// Rows and columns, from p, of the neighbours of p, q, r and s.
static const signed char neighbours[4][FEATURES][2] = {
    {{0, -1}, {-1, 0}, {-1, -1}, {-1, 1}, {0, 2}, {2, 0}, {1, -1}, {2, 2}, {2, -1}, {-1, 2}},
    {{0, 0}, {-1, 1}, {-1, 0}, {-1, 2}, {0, 2}, {2, 0}, {0, -1}, {2, 2}, {-1, 3}, {1, -1}},
    {{1, -1}, {0, 0}, {0, -1}, {0, 1}, {0, 2}, {2, 0}, {-1, 0}, {2, 2}, {2, -1}, {1, -2}},
    {{1, 0}, {0, 1}, {0, 0}, {0, 2}, {1, -1}, {2, 0}, {-1, 1}, {2, 2}, {2, -1}, {-1, 2}},
};
// In 1/4096, by the number of references of the plane: p, q, r, s.
static const i16 built_in[3][4][WEIGHTS] = {
    {{1283, 850, -177, -296, -434, -352, -446, 35, 70, 100, 0, 0},
     {227, 949, -216, 82, 496, -332, 6, -60, -59, -430, 0, 0},
     {879, -1135, -63, -2041, -306, 64, 1, -37, 8, -95, 0, 0},
     {-2398, -2582, -3112, 124, -69, 120, -19, 49, -39, -26, 0, 0}},
    {{1302, 842, -162, -324, -425, -337, -495, 16, 83, 120, 3189, 0},
     {230, 930, -202, 72, 490, -288, 23, -77, -47, -508, 3090, 0},
     {876, -1136, -54, -2058, -275, 82, 6, -56, 2, -102, 2994, 0},
     {-2437, -2642, -3130, 141, -51, 107, -6, 37, -42, -28, 2463, 0}},
    {{1278, 772, -108, -294, -437, -329, -484, 26, 74, 114, 2451, 650},
     {223, 904, -195, 78, 452, -299, 22, -59, -38, -496, 2489, 512},
     {895, -1126, -42, -2016, -293, 62, 10, -31, 16, -108, 2541, 958},
     {-2226, -2459, -2986, 142, -50, 129, -2, 48, -46, -35, 3242, 869}},
};

typedef struct {
  u8 *work;    // the component of the level below at twice its size, with a frame; then the level's
  u8 *errors;  // magnitudes of the errors of four rows
  i16 weights[4][WEIGHTS];
  i32 own[4];  // errors of the block
} Plane;

// Bits from the lowest of each byte upwards; behind the last are zeros.
static struct {
  const u8 *bytes;
  u64 at, end;
} bits;

static u32 plain_bits(u32 count) {
  u32 value = 0;
  for (u32 i = 0; i < count; i++, bits.at++) {
    if (bits.at < bits.end) value |= (u32)(bits.bytes[bits.at >> 3] >> (bits.at & 7) & 1) << i;
  }
  return value;
}

// A number below 2^33: a token, and for large ones plain bits.
static inline i64 number(u32 table) {
  u32 token = symbol(table);
  if (token < DIRECT) return token;
  u32 count = (token - DIRECT + 8) >> 2;
  if (count > PLAIN_TOP) {
    stream.stray = true;
    return 0;
  }
  return (i64)(4 + (token & 3)) << count | plain_bits(count);
}

static bool read_weights(const u8 **data, Plane *planes) {
  for (i32 c = 0; c < tile.components; c++) {
    i32 count = FEATURES + references_of(c);
    for (u32 k = 0; k < 4; k++) {
      i32 sum = 0;
      if (tile.end - *data < 2 * count) return false;
      for (i32 i = 0; i < count; i++, *data += 2) {
        planes[c].weights[k][i] = (i16)word16(*data);
        sum += magnitude(planes[c].weights[k][i]);
      }
      if (sum > WEIGHT_SUM) return false;
    }
  }
  return true;
}

static void enlarge(u8 *work, i32 component, i32 rows, i32 stride) {
  for (i32 y = 0; y < rows; y++, work += stride) {
    const u32 *from =
        tile.below + tile.bw * at_most(at_least((y - BEFORE) >> 1, 0), tile.bh - 1);
    for (i32 x = 0; x < stride; x++) {
      work[x] = (u8)(from[at_most(at_least((x - BEFORE) >> 1, 0), tile.bw - 1)] >> 8 * component);
    }
  }
}

int decode_texels(i32 error) {
  const u8 *data = tile.data;
  if (tile.end - data < 3 || tile.bw == 0 || tile.bh == 0) return DAMAGED;
  u32 form = data[0], numbering = data[1];
  i32 window = data[2];
  data += 3;
  if ((form != CODED && form != CODED_WITH_WEIGHTS) || numbering || window > WINDOW_TOP) {
    return DAMAGED;
  }
  i32 rows = tile.height + (tile.height & 1) + BEFORE + BEHIND;
  i32 stride = tile.width + (tile.width & 1) + BEFORE + BEHIND;
  Plane planes[MOST_PLANES];
  __builtin_memset(planes, 0, sizeof planes);
  for (i32 c = 0; c < tile.components; c++) {
    planes[c].work = take((u32)(rows * stride));
    planes[c].errors = take((u32)(4 * stride));
    if (!planes[c].work || !planes[c].errors) return NO_MEMORY;
    enlarge(planes[c].work, component_of(c), rows, stride);
    __builtin_memcpy(planes[c].weights, built_in[references_of(c)], sizeof built_in[0]);
  }
  if (form == CODED_WITH_WEIGHTS && !read_weights(&data, planes)) return DAMAGED;
  if (!read_tables(&data, TABLES, tokens, 78, false) || tile.end - data < 4) return DAMAGED;
  u32 length = word16(data) | word16(data + 2) << 16;
  data += 4;
  if (length > (u32)(tile.end - data)) return DAMAGED;
  bits.bytes = data;
  bits.at = 0;
  bits.end = 8 * (u64)length;
  if (!begin_stream(data + length)) return DAMAGED;

  i32 beside[4][FEATURES];
  for (u32 k = 0; k < 4; k++) {
    for (u32 j = 0; j < FEATURES; j++) {
      beside[k][j] = neighbours[k][j][0] * stride + neighbours[k][j][1];
    }
  }
  i32 step = 2 * error + 1, scale = 31 - __builtin_clz((u32)step);
  for (i32 y = 0; y < tile.height; y += 2) {
    for (i32 x = 0; x < tile.width; x += 2) {
      // A block takes up to 16 symbols, so words behind the end may be read.
      if (stream.word > stream.end || stream.stray) return DAMAGED;
      for (i32 c = 0; c < tile.components; c++) {
        Plane *plane = &planes[c];
        i32 count = references_of(c), at = 8 * component_of(c);
        u8 *p = plane->work + (y + BEFORE) * stride + x + BEFORE;
        for (i32 k = 0; k < 4; k++) {
          i32 py = y + (k >> 1), px = x + (k & 1);
          if (py >= tile.height || px >= tile.width) continue;
          const i16 *w = plane->weights[k];
          u8 *here = p + (k >> 1) * stride + (k & 1);
          i32 e1 = count > 0 ? planes[0].own[k] : 0, e2 = count > 1 ? planes[1].own[k] : 0;
          i32 total = w[10] * e1 + w[11] * e2 + 2048, slope = 0, base = *here;
          for (i32 j = 0; j < FEATURES; j++) {
            i32 f = p[beside[k][j]] - base;
            total += w[j] * f;
            if (j < 6) slope += magnitude(f);
          }
          i32 guess = at_most(at_least(base + (total >> 12), 0), 255);
          u8 *row = plane->errors + (py & 3) * stride + px;
          const u8 *up = plane->errors + ((py - 1) & 3) * stride + px;
          i32 near = 2 * (row[1] + up[2]) + up[1] + (k < 3 ? up[3] : row[1]);
          i32 a = count == 0   ? 16 * near + 2 * slope
                  : count == 1 ? 8 * near + slope + 16 * magnitude(e1)
                               : 8 * near + slope + 8 * magnitude(e1) + 24 * magnitude(e2);
          a >>= scale;
          i32 octave = a ? 32 - __builtin_clz((u32)a) - window : 0;
          i32 klass = a ? at_most(at_least(octave, 1), CLASSES - 1) : 0;
          i64 z = number((u32)(CLASSES * (4 * count + k) + klass));
          i64 exact = guess + (z & 1 ? -(z + 1) / 2 : z / 2) * step;
          i32 value = exact < 0 ? 0 : exact > 255 ? 255 : (i32)exact;
          *here = (u8)value;
          plane->own[k] = value - guess;
          row[2] = (u8)magnitude(value - guess);
          u32 *texel = tile.texels + py * tile.width + px;
          if (c == 0) *texel = opaque();
          *texel |= (u32)value << at;
        }
      }
    }
  }
  return end_stream() && (bits.at + 7) >> 3 == length ? OK : DAMAGED;
}
