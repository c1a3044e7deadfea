// The planes of a group of the Haar coder, and the rows that decoding needs.

#ifndef PTM_HAAR_H
#define PTM_HAAR_H

#include "memory.h"

enum { MOST_PLANES = 4 };
// The differences of a block.
enum { V, H, G };
// Of a row of numbers: room before the first, and behind the last of a whole eight.
enum { MARGIN = 8 };

typedef struct {
  i32 component, references;
  i16 weights[3][7];
  i16 *rows[8];         // ranks of the level below: row y is number y & 7
  i16 *gradient[2];     // of block row y: number y & 1, here and below
  i16 *value[3][2];     // V, h, g
  i16 *residual[3][2];  // and their residuals
  u16 *upper, *lower;   // texels of a row of blocks, two to a number, the left one in the low byte
  i32 top;              // the highest rank, 0 where values stand for themselves
  u8 rank[256], values[256];
} Plane;

extern Plane planes[MOST_PLANES];
extern i16 *zeros, *prediction;
extern u16 *symbols, *rest;  // rest: the bits above the components

// Room for all rows; false if memory is short.
bool take_rows(void);

// Flags, ranks and weights from *data on, which is moved behind them; false if they are damaged.
bool read_planes(const u8 **data);

#endif
