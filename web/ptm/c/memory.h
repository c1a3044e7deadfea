// The memory of the decoder, and its reader of bytes.
//
// The host decodes a tile at a time: it asks for room (`reserve`), writes the tile's bytes and the texels
// below into it, calls one of the coders and reads the texels. Only the built-in tables persist between
// calls. The host has checked all sizes: sides up to 65536, and no more memory than it allows.

#ifndef PTM_MEMORY_H
#define PTM_MEMORY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef uint8_t u8;
typedef uint16_t u16;
typedef uint32_t u32;
typedef int16_t i16;
typedef int32_t i32;
typedef uint64_t u64;
typedef int64_t i64;

// Results of a coder.
enum { OK, DAMAGED, NO_MEMORY };

// Texels that may be read and written behind the last one of a row, eight blocks at a time.
enum { BLOCKS = 8 };

// One tile: component c of a texel in bits 8 c … 8 c + 7. Above three components is alpha, 255.
typedef struct {
  const u8 *data, *end;  // its bytes, behind those that name its coder
  u32 *below;            // (height >> 1, width >> 1)
  u32 *texels;           // (height, width), to be filled
  i32 width, height, components;
  i32 bw, bh;  // blocks in a row and a column
} Tile;

extern Tile tile;

// Allocates zeroed bytes at an address that is a multiple of 16, until the next `reserve`; NULL if
// memory is short.
void *take(u32 size);

static inline u32 word16(const u8 *at) {
  u16 word;
  __builtin_memcpy(&word, at, sizeof word);
  return word;
}

// The bits above the components of a texel.
static inline u32 opaque(void) { return tile.components == 3 ? 0xff000000 : 0; }

static inline i32 at_least(i32 a, i32 low) { return a < low ? low : a; }
static inline i32 at_most(i32 a, i32 high) { return a > high ? high : a; }
static inline i32 magnitude(i32 a) { return a < 0 ? -a : a; }

// The component of each plane in coding order, and how many planes before it a plane refers to.
static inline i32 component_of(i32 plane) {
  return tile.components > 2 && plane < 2 ? 1 - plane : plane;
}
static inline i32 references_of(i32 plane) {
  return tile.components > 2 && plane < 3 ? plane : 0;
}

// The median of a, b and a + b - corner.
static inline i32 median(i32 a, i32 b, i32 corner) {
  i32 low = a < b ? a : b, high = a < b ? b : a;
  return at_most(at_least(a + b - corner, low), high);
}

// Texels that belong to no block: their number, and the place of each.
static inline i32 edge_count(void) {
  i32 tall = tile.width & 1 ? 2 * tile.bh : 0;
  return tall + (tile.height & 1 ? tile.width : 0);
}
static inline i32 edge_place(i32 i) {
  i32 tall = tile.width & 1 ? 2 * tile.bh : 0;
  return i < tall ? i * tile.width + tile.width - 1 : (tile.height - 1) * tile.width + i - tall;
}

// The neighbours that predict an edge texel: present ones stand for missing ones, 0 if all are missing.
typedef struct {
  u32 w, n, nw;
} Around;

static inline Around around_edge(i32 place) {
  const u32 *here = tile.texels + place;
  bool left = place % tile.width > 0, up = place >= tile.width;
  Around a;
  a.w = left ? here[-1] : up ? here[-tile.width] : 0;
  a.n = up ? here[-tile.width] : a.w;
  a.nw = left && up ? here[-tile.width - 1] : a.n;
  return a;
}

#endif
