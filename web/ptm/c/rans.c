#include "rans.h"

Table tables[MOST_TABLES];
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

static void fill(Table *table, const u16 *f) {
  u32 at = 0;
  for (u32 z = 0; z < 256; z++) {
    table->intervals[z] = (u32)f[z] << 12 | at;
    if (f[z]) __builtin_memset(table->slots + at, (int)z, f[z]);
    at += f[z];
  }
}

bool read_tables(const u8 **data, u32 count, const u16 (*family)[256], u32 kinds) {
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
    if (kind[t] == 0) {
      __builtin_memset(&tables[t], 0, sizeof(Table));
    } else if (kind[t] == SENT) {
      if (!read_sent(&from, sent)) return false;
      fill(&tables[t], sent);
    } else {
      fill(&tables[t], family[kind[t] - 1]);
    }
  }
  return !from.broken;
}

__attribute__((noinline)) u32 plain_symbol(const Table *table) {
  return step(&stream.state[stream.count++ & 3], table, &stream.word);
}

__attribute__((noinline)) u32 symbol(u32 table) {
  u32 z = step(&stream.state[stream.count++ & 3], &tables[table], &stream.word);
  return __builtin_expect(z == ESCAPE, 0) ? next_escape() : z;
}

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
