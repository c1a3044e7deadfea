// The page of `web_decoder.py --browser`: `files`, `rounds` and `packages` (name and URL) stand before
// it. Posts, for each decoder, the least milliseconds of each file.

const bytes = async (name) => new Uint8Array(await (await fetch(`/files/${name}`)).arrayBuffer());
const ptm = await Promise.all(files.map(bytes));
const png = await Promise.all(files.map((name) => bytes(name.replace(".ptm", ".png"))));

// All levels as one order, as a page decodes the levels that have come.
async function throughWorker({ readHeader, workers }, file) {
  const header = readHeader(file);
  const ends = header.levels.map(({ offset, length }) => offset + length);
  const begin = performance.now();
  await workers.decodeFirst(file, { ends, levels: ends.length });
  return performance.now() - begin;
}

async function asBitmap(_, file) {
  const blob = new Blob([file], { type: "image/png" });
  const begin = performance.now();
  const bitmap = await createImageBitmap(blob, { premultiplyAlpha: "none", colorSpaceConversion: "none" });
  const taken = performance.now() - begin;
  bitmap.close();
  return taken;
}

const decoders = { PNG: { decode: asBitmap, files: png } };
for (const [name, url] of Object.entries(packages)) {
  const { DecoderWorkers, readHeader } = await import(`${url}/src/index.js`);
  const workers = new DecoderWorkers({ count: 1 });
  decoders[name] = { decode: throughWorker, files: ptm, readHeader, workers };
}
const least = Object.fromEntries(Object.keys(decoders).map((name) => [name, files.map(() => Infinity)]));
for (let round = 0; round < rounds; round++) {
  for (let i = 0; i < files.length; i++) {
    for (const [name, decoder] of Object.entries(decoders)) {
      least[name][i] = Math.min(least[name][i], await decoder.decode(decoder, decoder.files[i]));
    }
  }
}
post("/done", JSON.stringify(least));
