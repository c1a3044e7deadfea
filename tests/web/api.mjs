// What a page does with the package, in node: prints one JSON object for `test_api.py`.

import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";

import { DecoderWorkers, loadEngine, openPtm, serve } from "../../web/ptm/src/index.js";

const file = new Uint8Array(readFileSync(process.argv[2]));
const wasm = readFileSync(new URL("../../web/ptm/src/decoder.wasm", import.meta.url));
const report = {};

const digest = (image) => createHash("sha256").update(image.data).digest("hex");
const settled = (promise) => promise.then(() => null, (error) => (error.name === "PtmError" ? error.code : error.name));

/** Ranges of `bytes`, and which were asked for. */
function ranges(bytes) {
  const asked = [];
  const read = async (offset, length) => {
    asked.push([offset, length]);
    return bytes.slice(offset, offset + length);
  };
  return { asked, read };
}

async function digests(ptm, options) {
  const found = [];
  for await (const image of ptm.decode({ format: "native", ...options })) found.push(digest(image));
  return found;
}

const engine = await loadEngine(wasm);
report.refusals = [await settled(loadEngine(new Uint8Array(8)))];
const { validate } = WebAssembly;
WebAssembly.validate = () => false;
report.refusals.push(await settled(loadEngine(wasm)));
WebAssembly.validate = validate;

const whole = ranges(file);
const ptm = await openPtm(whole.read);
report.rangesOf = ptm.levels.map((_, n) => Object.values(ptm.rangeOf(n)));
report.levels = await digests(ptm, { engine });
report.asked = [...whole.asked];
report.one = digest(await ptm.image(3, { engine, format: "native" }));
report.noLevel = await settled(ptm.image(99, { engine }));

// A file that is cut after level 4, and within level 5.
const { offset, length } = ptm.rangeOf(4);
const cut = file.slice(0, offset + length + 7);
const cutPtm = await openPtm(ranges(cut).read);
report.cut = await digests(cutPtm, { engine });
report.cutLevel = await settled(cutPtm.image(5, { engine }));

// Workers: two of them, each a thread's end of a channel.
const ports = [];
const create = () => {
  const { port1, port2 } = new MessageChannel();
  serve(port2);
  ports.push(port2);
  return port1;
};
const workers = new DecoderWorkers({ count: 2, create, wasm: await WebAssembly.compile(wasm) });
const both = await Promise.all([digests(ptm, { workers }), digests(cutPtm, { workers })]);
report.workers = both;

// Bytes stay whose they were; what is refused can be given again; what is aborted is not lost.
const group = (n) => file.slice(ptm.levels[n].offset, ptm.levels[n].offset + ptm.levels[n].length);
const remote = workers.decoder(ptm.header, { format: "native" });
const bad = group(0);
bad[bad.length - 1] ^= 1;
report.damaged = await settled(remote.refine(bad));
const first = group(0);
report.first = digest(await remote.refine(first));
report.kept = first.length;
const stop = new AbortController();
const going = settled(remote.refine(group(1), { signal: stop.signal }));
stop.abort();
report.aborted = await going;
report.again = digest(await remote.refine(group(1)));
// Several levels in one go, all or until one is damaged; and of a file that is not the expected one.
const ends = ptm.levels.map(({ offset, length }) => offset + length);
const options = { ends, levels: 4, format: "native" };
report.several = (await workers.decodeFirst(file.subarray(0, ends[3]), options)).map(digest);
const spoiled = file.slice();
spoiled[ends[2] - 1] ^= 1;
const refused = await workers.decodeFirst(spoiled, options).catch((error) => error);
const other = await workers.decodeFirst(file, { ...options, ends: ends.slice(1) }).catch((error) => error);
report.refused = [refused.code, refused.decoded, other.code, other.decoded];
// One of two has failed: the other has all the work.
const halved = new DecoderWorkers({ count: 2, create, wasm });
halved.lanes[0].fail(new Error("did not start"));
report.halved = [await digests(ptm, { workers: halved }), await digests(ptm, { workers: halved })];
halved.close();
const busy = workers.decoder(ptm.header, {});
const lane = busy.lane;
const before = workers.decoder(ptm.header, {});
before.lane = lane;
report.before = await settled(before.refine(group(0), { signal: AbortSignal.abort() }));
report.closing = settled(remote.refine(group(2)));
workers.close();
report.closing = await report.closing;
for (const port of ports) port.close();
report.openAborted = await settled(openPtm(whole.read, { signal: AbortSignal.abort() }));
console.log(JSON.stringify(report));
