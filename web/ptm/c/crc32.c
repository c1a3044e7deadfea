// CRC-32 of PNG and zip, sixteen bytes at a time (Kounavis & Berry, "slicing by 8").

#include "memory.h"

enum { SLICES = 16 };
// Of a byte that has slice number of bytes behind it.
static u32 slices[SLICES][256];

static void fill_slices(void) {
  for (u32 i = 0; i < 256; i++) {
    u32 crc = i;
    for (u32 bit = 0; bit < 8; bit++) crc = crc >> 1 ^ (crc & 1 ? 0xedb88320 : 0);
    slices[0][i] = crc;
  }
  for (u32 k = 1; k < SLICES; k++) {
    for (u32 i = 0; i < 256; i++) {
      slices[k][i] = slices[k - 1][i] >> 8 ^ slices[0][slices[k - 1][i] & 255];
    }
  }
}

// Of four bytes, the first of which has `behind` bytes behind it.
static inline u32 of_four(u32 word, u32 behind) {
  return slices[behind][word & 255] ^ slices[behind - 1][word >> 8 & 255] ^
         slices[behind - 2][word >> 16 & 255] ^ slices[behind - 3][word >> 24];
}

u32 crc32(const u8 *at, u32 length) {
  if (!slices[0][1]) fill_slices();
  u32 crc = ~0u, word[4];
  for (; length >= SLICES; at += SLICES, length -= SLICES) {
    __builtin_memcpy(word, at, sizeof word);
    crc = of_four(word[0] ^ crc, 15) ^ of_four(word[1], 11) ^ of_four(word[2], 7) ^
          of_four(word[3], 3);
  }
  for (; length; length--) crc = crc >> 8 ^ slices[0][(crc ^ *at++) & 255];
  return ~crc;
}
