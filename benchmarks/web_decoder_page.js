// The page of `web_decoder.py --browser`: `files` and `rounds` stand before it. Posts, for each
// decoder, the least milliseconds of each file.

import { DecoderWorkers, readHeader } from "/ptm/src/index.js";

const bytes = async (name) => new Uint8Array(await (await fetch(`/files/${name}`)).arrayBuffer());
const ptm = await Promise.all(files.map(bytes));
const png = await Promise.all(files.map((name) => bytes(name.replace(".ptm", ".png"))));

async function throughWorker(workers, file) {
  const header = readHeader(file);
  const begin = performance.now();
  const decoder = workers.decoder(header);
  for (const { offset, length } of header.levels) {
    await decoder.refine(file.subarray(offset, offset + length));
  }
  const taken = performance.now() - begin;
  decoder.close();
  return taken;
}

async function asBitmap(file) {
  const blob = new Blob([file], { type: "image/png" });
  const begin = performance.now();
  const bitmap = await createImageBitmap(blob, { premultiplyAlpha: "none", colorSpaceConversion: "none" });
  const taken = performance.now() - begin;
  bitmap.close();
  return taken;
}

const wasm = new DecoderWorkers({ count: 1 });
const least = { wasm: [], PNG: [] };
for (let i = 0; i < files.length; i++) for (const times of Object.values(least)) times.push(Infinity);
for (let round = 0; round < rounds; round++) {
  for (let i = 0; i < files.length; i++) {
    least.wasm[i] = Math.min(least.wasm[i], await throughWorker(wasm, ptm[i]));
    least.PNG[i] = Math.min(least.PNG[i], await asBitmap(png[i]));
  }
}
post("/done", JSON.stringify(least));
