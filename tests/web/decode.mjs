// Decodes many files and says what each held: one line of JSON for each, in order.
//
//   node decode.mjs CASES [native|rgba] [MEMORY]
//
// CASES: for each file its length in four bytes and its bytes.

import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";

import { readHeader } from "../../web/ptm/src/container.js";
import { DECODER_URL, loadEngine } from "../../web/ptm/src/engine.js";
import { LevelDecoder } from "../../web/ptm/src/level-decoder.js";

const [, , path, format = "native", memory] = process.argv;
const engine = await loadEngine(readFileSync(DECODER_URL));
const cases = readFileSync(path);
for (let at = 0; at < cases.length; ) {
  const length = cases.readUInt32LE(at);
  const file = new Uint8Array(cases.subarray(at + 4, at + 4 + length));
  at += 4 + length;
  const levels = [];
  let error = null;
  try {
    const header = readHeader(file);
    const options = { format, ...(memory && { memory: Number(memory) }) };
    const decoder = new LevelDecoder(header, engine, options);
    for (const level of header.levels) {
      if (level.offset + level.length > file.length) break;
      const image = decoder.refine(file.subarray(level.offset, level.offset + level.length));
      levels.push(createHash("sha256").update(image.data).digest("hex"));
    }
  } catch (problem) {
    if (problem.name !== "PtmError") throw problem;
    error = problem.code;
  }
  console.log(JSON.stringify({ levels, error }));
}
