// The exports of the module: a checksum; room for a tile, then one of three coders; room for a buffer
// view, then one of meshopt's.

#include "memory.h"
#include "rans.h"

#define EXPORT(name) __attribute__((export_name(#name)))

int decode_haar(void);
int decode_repeats(void);
int decode_texels(i32 error);
int decode_attributes(const u8 *at, const u8 *end, i32 count, i32 stride, u8 *out);
void filter_exponential(u32 *number, i32 count);
int decode_triangles(const u8 *at, const u8 *end, i32 count, u32 vertices, u32 *out);
u32 crc32(const u8 *at, u32 length);

Tile tile;

extern u8 __heap_base;
// Rows are read and written sixteen texels at a time: so much further at most.
enum { PAGE = 1 << 16, WORD_BYTES = 2, ROOM_BEHIND = 256, VIEW_BEHIND = 15 * 256 };
static u64 used;

// Grows the memory to a number of bytes.
static bool grown(u64 size) {
  u64 have = (u64)__builtin_wasm_memory_size(0) * PAGE;
  if (size <= have) return true;
  u64 pages = (size - have + PAGE - 1) / PAGE;
  return pages < PAGE && __builtin_wasm_memory_grow(0, (size_t)pages) != (size_t)-1;
}

// Allocates bytes, not cleared.
static void *room(u64 size) {
  u64 begin = used;
  if (size > UINT32_MAX || !grown(begin + size)) return NULL;
  used = (begin + size + 15) & ~(u64)15;
  return (void *)(uintptr_t)begin;
}

void *take(u32 size) {
  void *begin = room(size);
  if (begin) __builtin_memset(begin, 0, size);
  return begin;
}

// Where the host writes the built-in tables: 34 of Haar and repeats, 78 of the texel coder.
EXPORT(geometric_tables) u16 *geometric_tables(void) { return geometric[0]; }
EXPORT(token_tables) u16 *token_tables(void) { return tokens[0]; }

// Allocates bytes in the place of all others; NULL if memory is short.
EXPORT(reserve_bytes) const u8 *reserve_bytes(u32 length) {
  used = ((u64)(uintptr_t)&__heap_base + 15) & ~(u64)15;
  return room(length);
}
EXPORT(checksum) u32 checksum(const u8 *bytes, u32 length) { return crc32(bytes, length); }

// Allocates the bytes and texels of a tile; false if memory is short.
EXPORT(reserve) bool reserve(u32 length, i32 width, i32 height, i32 components) {
  used = ((u64)(uintptr_t)&__heap_base + 15) & ~(u64)15;
  i32 bw = width >> 1, bh = height >> 1;
  // Words behind the end of a stream are read until it is looked at: those of a row or of the edge.
  u64 behind = ROOM_BEHIND + WORD_BYTES * (u64)(width + 2 * height) * 4;
  u8 *data = room(length + behind);
  u32 *below = room(4 * (u64)bw * (u64)bh + ROOM_BEHIND);
  u32 *texels = room(4 * (u64)width * (u64)height + ROOM_BEHIND);
  if (!data || !below || !texels) return false;
  tile = (Tile){data, data + length, below, texels, width, height, components, bw, bh};
  return true;
}

// Allocates the bytes and the elements of a buffer view; false if memory is short. They lie where those
// of a tile do.
EXPORT(reserve_view) bool reserve_view(u32 length, u32 size) {
  used = ((u64)(uintptr_t)&__heap_base + 15) & ~(u64)15;
  u8 *data = room(length);
  u32 *elements = room((u64)size + VIEW_BEHIND);
  if (!data || !elements) return false;
  tile = (Tile){.data = data, .end = data + length, .texels = elements};
  return true;
}

EXPORT(data) const u8 *data(void) { return tile.data; }
EXPORT(below) const u32 *below(void) { return tile.below; }
EXPORT(texels) const u32 *texels(void) { return tile.texels; }

EXPORT(haar) int haar(void) { return decode_haar(); }
EXPORT(repeats) int repeats(void) { return decode_repeats(); }
EXPORT(texel) int texel(i32 error) { return decode_texels(error); }

EXPORT(attributes) int attributes(i32 count, i32 stride, i32 exponential) {
  int result = decode_attributes(tile.data, tile.end, count, stride, (u8 *)tile.texels);
  if (result == OK && exponential) filter_exponential(tile.texels, count * (stride / 4));
  return result;
}
EXPORT(triangles) int triangles(i32 count, u32 vertices) {
  return decode_triangles(tile.data, tile.end, count, vertices, tile.texels);
}
