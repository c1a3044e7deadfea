// Frequency tables and interleaved rANS (docs/formats/ptm.md, "Tables and symbols").

#ifndef PTM_RANS_H
#define PTM_RANS_H

#include "memory.h"

enum { SUM = 2048, ESCAPE = 255, STATE_LOW = 1 << 15, MOST_TABLES = 236 };

// Three KB stay in a core's own cache; eight, with all data at each slot, do not.
typedef struct {
  u8 slots[SUM];       // the symbol of each
  u32 intervals[256];  // of each symbol: frequency << 12 | where its slots begin
} Table;

extern Table tables[MOST_TABLES];

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

// Reads a number of tables from *data on, which is moved behind them; false if they are damaged.
bool read_tables(const u8 **data, u32 count, const u16 (*family)[256], u32 kinds);

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

// A symbol from one state: renewed without a branch, which would be guessed wrong half of the time.
static inline u32 step(u32 *state, const Table *table, const u8 **word) {
  u32 x = *state, slot = x & (SUM - 1);
  u32 z = table->slots[slot], interval = table->intervals[z];
  x = (interval >> 12) * (x >> 11) + slot - (interval & 4095);
  u32 renewed = x << 16 | word16(*word);
  bool low = x < STATE_LOW;
  *state = low ? renewed : x;
  *word += low ? 2 : 0;
  return z;
}

// The next symbol, 255 as it is.
u32 plain_symbol(const Table *table);

// The next symbol. One copy of it in the module costs no time that can be measured.
u32 symbol(u32 table);

static inline i32 signed_of(u32 z) { return (i32)(z >> 1) ^ -(i32)(z & 1); }

#endif
