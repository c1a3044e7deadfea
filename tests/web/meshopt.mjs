// Decodes buffer views: node meshopt.mjs FOLDER
// FOLDER/views.json lists {mode, count, byteStride, filter, vertices}; n.bin is the n-th view. Prints for each
// the SHA-256 of what it decodes to, or the error.

import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";
import { loadViewDecoder } from "../../web/ptm/src/meshopt.js";

const folder = process.argv[2];
const wasm = new URL("../../web/ptm/src/decoder.wasm", import.meta.url);
const decoder = await loadViewDecoder(readFileSync(wasm));
const views = JSON.parse(readFileSync(`${folder}/views.json`, "utf8"));
const results = views.map(({ mode, count, byteStride, filter, vertices }, n) => {
  const data = readFileSync(`${folder}/${n}.bin`);
  try {
    const decoded = mode === "TRIANGLES"
      ? decoder.triangles(data, count, vertices)
      : decoder.attributes(data, count, byteStride, filter === "EXPONENTIAL");
    return { hash: createHash("sha256").update(decoded).digest("hex") };
  } catch (fault) {
    return { error: String(fault) };
  }
});
console.log(JSON.stringify(results));
