// Decodes files with the decoder at a URL, joined or not: a line of JSON with what came out.
//
//   node decode.mjs INDEX [WASM] FILE…    without WASM ("-") the engine is plain JavaScript

import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const [index, wasm, ...files] = process.argv.slice(2);
const ptm = await import(pathToFileURL(index).href);
// Node fetches no files: so the engine is loaded as where there is no WebAssembly.
const engine = await ptm.loadEngine(wasm === "-" ? undefined : readFileSync(wasm));
const found = files.map((file) => {
  const bytes = new Uint8Array(readFileSync(file));
  try {
    const header = ptm.readHeader(bytes);
    const decoder = new ptm.LevelDecoder(header, engine, { format: "native" });
    return header.levels.map(({ offset, length }) => {
      const { data } = decoder.refine(bytes.subarray(offset, offset + length));
      return createHash("sha256").update(data).digest("hex");
    });
  } catch (error) {
    if (!(error instanceof ptm.PtmError)) throw error;
    return error.code;
  }
});
const url = ptm.DECODER_URL.href;
console.log(JSON.stringify({ engine: engine.name, exports: Object.keys(ptm), url, found }));
