#include <wasm_simd128.h>

#include "rans.h"

RowTable row_tables[MOST_ROW_TABLES];
SingleTable single_tables[MOST_TABLES];
Stream stream;
u16 geometric[34][256], tokens[78][256];

enum { FIRST_KIND = 4, SENT = 255 };

// Numbers of three bits a nibble; `broken` once one is too long or missing.
typedef struct {
  const u8 *bytes;
  u32 at, end;
  bool broken;
} Nibbles;

static u32 next_number(Nibbles *from) {
  u32 n = 0;
  for (u32 shift = 0;; shift += 3) {
    u32 i = from->at++;
    if (i >= from->end || shift > 9) {
      from->broken = true;
      return 0;
    }
    u32 nibble = (u32)from->bytes[i >> 1] >> (4 * (i & 1));
    n |= (nibble & 7) << shift;
    if (!(nibble & 8)) return n;
  }
}

static bool read_sent(Nibbles *from, u16 *f) {
  for (u32 z = 0; z < 256; z++) f[z] = 0;
  u32 sum = f[ESCAPE] = (u16)next_number(from);
  u32 used = next_number(from);
  if (used > ESCAPE) return false;
  for (u32 z = 0; z < used; z++) sum += f[z] = (u16)next_number(from);
  return !from->broken && sum == SUM;
}

// A table without frequencies is not used; of a damaged stream it makes zeros.
static void fill_row(RowTable *table, const u16 *f) {
  u32 at = 0;
  if (!f) __builtin_memset(table, 0, sizeof *table);
  for (u32 z = 0; f && z < 256; z++) {
    table->intervals[z][0] = (u16)at;
    table->intervals[z][1] = f[z];
    // Sixteen at a time, further than needed.
    const v128_t many = wasm_i8x16_splat((signed char)z);
    for (u32 end = at + f[z], i = at; i < end; i += 16) wasm_v128_store(table->slots + i, many);
    at += f[z];
  }
}

static void fill_single(SingleTable *table, const u16 *f) {
  u32 at = 0, many = 0, bucket = 0;
  if (!f) {
    __builtin_memset(table, 0, sizeof *table);
    many = 1;
  }
  for (u32 z = 0; f && z < 256; z++) {
    if (!f[z]) continue;
    table->entries[many] = z << 24 | (u32)f[z] << 12 | at;
    at += f[z];
    while (bucket << BUCKET_BITS < at) table->first[bucket++] = (u8)many;
    many++;
  }
  table->entries[many] = SUM;
}

bool read_tables(const u8 **data, u32 count, const u16 (*family)[256], u32 kinds,
                 bool rows) {
  u8 kind[MOST_TABLES];
  u16 sent[256];
  if (tile.end - *data < 2) return false;
  u32 length = word16(*data);
  *data += 2;
  if (tile.end - *data < (ptrdiff_t)length) return false;
  Nibbles from = {*data, 0, 2 * length, false};
  *data += length;
  i32 now = FIRST_KIND;
  for (u32 t = 0; t < count;) {
    u32 n = next_number(&from);
    if (n == 0) {
      u32 more = next_number(&from);
      if (from.broken || more >= count - t) return false;
      for (u32 end = t + 1 + more; t < end; t++) kind[t] = 0;
      continue;
    }
    if (n > 1) {
      now += n & 1 ? -(i32)((n - 1) >> 1) : (i32)((n - 2) >> 1);
      if (now < 1 || now > (i32)kinds) return false;
    }
    kind[t++] = n == 1 ? SENT : (u8)now;
  }
  for (u32 t = 0; t < count; t++) {
    if (kind[t] == SENT && !read_sent(&from, sent)) return false;
    const u16 *f = kind[t] == 0 ? NULL : kind[t] == SENT ? sent : family[kind[t] - 1];
    if (rows) {
      fill_row(&row_tables[t], f);
    } else {
      fill_single(&single_tables[t], f);
    }
  }
  return !from.broken;
}

u32 row_symbol(const RowTable *table) {
  u32 *state = &stream.state[stream.count++ & 3];
  u32 slot = *state & (SUM - 1), z = table->slots[slot];
  const u16 *interval = table->intervals[z];
  *state = renewed(interval[1] * (*state >> 11) + slot - interval[0], &stream.word);
  return z;
}

__attribute__((noinline)) u32 symbol(u32 number) { return symbol_here(number); }

bool begin_stream(const u8 *data) {
  if (tile.end - data < 4) return false;
  u32 escapes = word16(data) | word16(data + 2) << 16;
  data += 4;
  u32 left = (u32)(tile.end - data);
  if (escapes > left / 2) return false;
  stream.escape = data;
  stream.escapes_end = data + 2 * escapes;
  left -= 2 * escapes;
  if (left < 16 || left & 1) return false;
  stream.word = stream.escapes_end;
  stream.end = tile.end;
  for (u32 lane = 0; lane < 4; lane++, stream.word += 4) {
    stream.state[lane] = word16(stream.word) | (word16(stream.word + 2) & 0x7fff) << 16;
  }
  stream.count = 0;
  stream.stray = false;
  return true;
}

bool end_stream(void) {
  bool clean = !stream.stray && stream.word == stream.end && stream.escape == stream.escapes_end;
  for (u32 lane = 0; lane < 4; lane++) clean &= stream.state[lane] == STATE_LOW;
  return clean;
}
