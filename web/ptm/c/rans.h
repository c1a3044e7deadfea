// Frequency tables and interleaved rANS (docs/formats/ptm.md, "Tables and symbols").

#ifndef PTM_RANS_H
#define PTM_RANS_H

#include "memory.h"

enum { SUM = 2048, ESCAPE = 255, STATE_LOW = 1 << 15, MOST_TABLES = 236, MOST_ROW_TABLES = 29,
       BUCKET_BITS = 3 };

// For rows of symbols whose tables are known (Haar). The padding makes a table an odd number of cache
// lines, so that the first intervals of all tables do not compete for the same lines.
typedef struct {
  u16 intervals[256][2];  // of each symbol: where its slots begin, frequency
  u8 slots[SUM];          // the symbol of each
  u8 apart[64];
} RowTable;

// For single symbols by any of many tables (repeats, texels): a tenth of the cache lines, and a
// search that seldom takes a step.
typedef struct {
  u8 first[SUM >> BUCKET_BITS];  // the entry of the first slot of each bucket
  u32 entries[257];  // of the symbols in use: symbol << 24 | frequency << 12 | where its slots begin
  u8 apart[60];
} SingleTable;

extern RowTable row_tables[MOST_ROW_TABLES];

// The stream of a group.
typedef struct {
  u32 state[4];  // that of the next symbol is number `count & 3`
  u32 count;
  const u8 *word, *end;  // of the words: end is where they should end
  const u8 *escape, *escapes_end;
  bool stray;  // whether something impossible has happened
} Stream;

extern Stream stream;

// Frequencies of built-in tables, as the host writes them: 34 of the coders Haar and repeats, 78 of
// the texel coder.
extern u16 geometric[34][256], tokens[78][256];

// Reads a number of tables from *data on, which is moved behind them, as row tables or single ones;
// false if they are damaged.
bool read_tables(const u8 **data, u32 count, const u16 (*family)[256], u32 kinds, bool rows);

// Begins the stream that is from `data` to the end of the tile. Words behind its end may be read,
// but no further than the host has left room for.
bool begin_stream(const u8 *data);

// Whether all of the stream has been used and nothing impossible has happened.
bool end_stream(void);

// The value of a symbol 255.
static inline u32 next_escape(void) {
  if (stream.escape == stream.escapes_end) {
    stream.stray = true;
    return 0;
  }
  stream.escape += 2;
  return word16(stream.escape - 2);
}

// A state below its range renewed by the next word: without a branch, which would be guessed wrong half
// of the time.
static inline u32 renewed(u32 x, const u8 **word) {
  u32 longer = x << 16 | word16(*word);
  bool low = x < STATE_LOW;
  *word += low ? 2 : 0;
  return low ? longer : x;
}

// The next symbol by a row table, 255 as it is.
u32 row_symbol(const RowTable *table);

// The next symbol by a single table. Inlined where it is called most often, it saves a thirtieth of the
// time of repeats; everywhere, another fiftieth, and the module would be 3 kB larger.
extern SingleTable single_tables[MOST_TABLES];
static inline __attribute__((always_inline)) u32 symbol_here(u32 number) {
  const SingleTable *table = &single_tables[number];
  u32 *state = &stream.state[stream.count++ & 3];
  u32 x = *state, slot = x & (SUM - 1);
  const u32 *entry = table->entries + table->first[slot >> BUCKET_BITS];
  while ((entry[1] & 4095) <= slot) entry++;
  u32 e = *entry, z = e >> 24;
  *state = renewed((e >> 12 & 4095) * (x >> 11) + slot - (e & 4095), &stream.word);
  return __builtin_expect(z == ESCAPE, 0) ? next_escape() : z;
}

u32 symbol(u32 table);

static inline i32 signed_of(u32 z) { return (i32)(z >> 1) ^ -(i32)(z & 1); }

#endif
