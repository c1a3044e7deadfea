// Huge levels before a decoder: prints the codes of what is refused, and the bytes that it took.

import { readFileSync } from "node:fs";

import { DECODER_URL, loadEngine } from "../../web/ptm/src/engine.js";
import { LevelDecoder } from "../../web/ptm/src/level-decoder.js";

const engine = await loadEngine(readFileSync(DECODER_URL));
const before = process.memoryUsage().arrayBuffers;
for (const tile of [0, 512]) {
  const counts = tile ? { across: 128, down: 128 } : { across: 1, down: 1 };
  const level = { width: 65536, height: 65536, offset: 64, length: 0, crc32: 0, ...counts };
  const header = { components: 4, profile: 1, tile, maxError: 0, levels: [level] };
  try {
    new LevelDecoder(header, engine).refine(new Uint8Array(0));
  } catch (error) {
    console.log(error.code);
  }
}
console.log(process.memoryUsage().arrayBuffers - before);
