// Times decoders of web/ptm: for each package and file the milliseconds of processor time in which it
// decodes all levels, the least of several rounds, as one line of JSON. Packages take turns.
//
//   node web_decoder.mjs ROUNDS PACKAGE[,PACKAGE] FILE.ptm …

import { readFileSync } from "node:fs";

const [, , rounds, folders, ...paths] = process.argv;
const packages = await Promise.all(
  folders.split(",").map(async (folder) => {
    const [{ readHeader }, { DECODER_URL, loadEngine }, { LevelDecoder }] = await Promise.all(
      ["container", "engine", "level-decoder"].map((name) => import(`${folder}/src/${name}.js`)),
    );
    const engine = await loadEngine(readFileSync(DECODER_URL));
    return { readHeader, LevelDecoder, engine, least: paths.map(() => Infinity) };
  }),
);
const files = paths.map((path) => new Uint8Array(readFileSync(path)));
for (let round = 0; round < Number(rounds); round++) {
  files.forEach((file, i) => {
    for (const { readHeader, LevelDecoder, engine, least } of packages) {
      const header = readHeader(file);
      const begin = process.cpuUsage();
      const decoder = new LevelDecoder(header, engine);
      for (const { offset, length } of header.levels) decoder.refine(file.subarray(offset, offset + length));
      const { user, system } = process.cpuUsage(begin);
      least[i] = Math.min(least[i], (user + system) / 1000);
    }
    packages.push(packages.shift());
  });
}
for (let turns = (Number(rounds) * files.length) % packages.length; turns; turns--) {
  packages.unshift(packages.pop());
}
console.log(JSON.stringify(packages.map(({ least }) => least)));
