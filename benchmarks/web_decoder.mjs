// Times the decoder of web/ptm: for each file the milliseconds in which it decodes all its levels,
// the least of several rounds, as one line of JSON.
//
//   node web_decoder.mjs ROUNDS FILE.ptm …

import { readFileSync } from "node:fs";

import { readHeader } from "../web/ptm/src/container.js";
import { DECODER_URL, loadEngine } from "../web/ptm/src/engine.js";
import { LevelDecoder } from "../web/ptm/src/level-decoder.js";

const [, , rounds, ...paths] = process.argv;
const engine = await loadEngine(readFileSync(DECODER_URL));
const files = paths.map((path) => new Uint8Array(readFileSync(path)));
const least = files.map(() => Infinity);
let first = 0;
for (let round = 0; round < Number(rounds); round++) {
  files.forEach((file, i) => {
    const header = readHeader(file);
    const begin = performance.now();
    const decoder = new LevelDecoder(header, engine);
    for (const { offset, length } of header.levels) decoder.refine(file.subarray(offset, offset + length));
    const taken = performance.now() - begin;
    if (!round && !i) first = taken;
    least[i] = Math.min(least[i], taken);
  });
}
console.log(JSON.stringify({ first, least }));
