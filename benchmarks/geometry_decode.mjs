// Decodes compressed views by the page's module and by meshoptimizer: node geometry_decode.mjs FOLDER PACKAGE
// FOLDER/views.json lists the extensions of the views, views.bin holds their bytes one after the other. Prints
// MB/s of decoded data of both; fails where they differ.

import { readFileSync } from "node:fs";
import { loadViewDecoder } from "../web/ptm/src/meshopt.js";

const [folder, root] = process.argv.slice(2);
const { MeshoptDecoder } = await import(`${root}/meshopt_decoder.mjs`);
await MeshoptDecoder.ready;
const wasm = new URL("../web/ptm/src/decoder.wasm", import.meta.url);
const ours = await loadViewDecoder(readFileSync(wasm));

const bytes = readFileSync(`${folder}/views.bin`);
let at = 0;
const views = JSON.parse(readFileSync(`${folder}/views.json`, "utf8")).map((row) => {
  const data = new Uint8Array(bytes.subarray(at, at + row.byteLength));
  at += row.byteLength;
  return { ...row, data, target: new Uint8Array(row.count * row.byteStride) };
});
const total = views.reduce((sum, { target }) => sum + target.length, 0);

const decodeOurs = ({ mode, data, count, byteStride, filter }) =>
  mode === "TRIANGLES"
    ? ours.triangles(data, count, 2 ** 32 - 1)
    : ours.attributes(data, count, byteStride, filter === "EXPONENTIAL");
const decodeTheirs = ({ mode, data, count, byteStride, filter, target }) => {
  MeshoptDecoder.decodeGltfBuffer(target, count, byteStride, data, mode, filter);
  return target;
};

for (const view of views) {
  const theirs = decodeTheirs(view), own = decodeOurs(view);
  const kind = view.byteStride === 2 ? Uint16Array : Uint32Array;
  const same = view.mode === "TRIANGLES" ? new kind(theirs.buffer) : theirs;
  if (!own.every((value, k) => value === same[k])) throw new Error("the decoders differ");
}

function speed(decode) {
  let best = Infinity;
  for (let run = 0; run < 3; run++) {
    const begun = performance.now();
    let times = 0;
    do {
      for (const view of views) decode(view);
      times++;
    } while (performance.now() - begun < 500);
    best = Math.min(best, (performance.now() - begun) / times);
  }
  return total / best / 1e3;
}

console.log(JSON.stringify([speed(decodeOurs), speed(decodeTheirs)]));
