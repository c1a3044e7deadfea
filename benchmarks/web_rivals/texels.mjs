// What a KTX2 file holds: `node texels.mjs PACKAGE FILE OUT` writes the RGBA of all its levels, the
// finest first, rows from the top.

import { readFileSync, writeFileSync } from "node:fs";

const RGBA32 = 13; // Basis Universal's number of that format
const [home, file, out] = process.argv.slice(2);
const { default: loaded } = await import(`${home}/dist/basis/basis_encoder.js`);
const basis = await loaded();
basis.initializeBasis();
const ktx2 = new basis.KTX2File(new Uint8Array(readFileSync(file)));
if (!ktx2.isValid() || !ktx2.startTranscoding()) throw new Error(`${file} cannot be read`);
const levels = [];
for (let level = 0; level < ktx2.getLevels(); level++) {
  const texels = new Uint8Array(ktx2.getImageTranscodedSizeInBytes(level, 0, 0, RGBA32));
  if (!ktx2.transcodeImage(texels, level, 0, 0, RGBA32, 0, -1, -1)) throw new Error(`level ${level}`);
  levels.push(texels);
}
writeFileSync(out, Buffer.concat(levels));
