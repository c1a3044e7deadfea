// Positions, colours and indices of the shapes of GLBs, as the page reads them.

import { readFileSync } from "node:fs";
import { readGlb } from "../../web/page/data/glb.js";
import { loadViewDecoder } from "../../web/ptm/src/meshopt.js";

const wasm = new URL("../../web/ptm/src/decoder.wasm", import.meta.url);
const decoder = loadViewDecoder(readFileSync(wasm));
const read = async (file) => {
  const { shapes } = await readGlb(Uint8Array.from(readFileSync(file)).buffer, 0, () => decoder);
  return shapes.map(({ positions, colors, indices }) =>
    ({ positions: [...positions], colors: colors && [...colors], indices: [...indices] }));
};
console.log(JSON.stringify(await Promise.all(process.argv.slice(2).map(read))));
