// What a page does with the package, in node: prints one JSON object for `test_api.py`.

import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";

import { DecoderWorkers, loadEngine, openPtm, serve } from "../../web/ptm/src/index.js";

const file = new Uint8Array(readFileSync(process.argv[2]));
const wasm = readFileSync(new URL("../../web/ptm/src/decoder.wasm", import.meta.url));
const told = {};

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
told.refusals = [await settled(loadEngine(new Uint8Array(8)))];
const { validate } = WebAssembly;
WebAssembly.validate = () => false;
told.refusals.push(await settled(loadEngine(wasm)));
WebAssembly.validate = validate;

const whole = ranges(file);
const ptm = await openPtm(whole.read);
told.rangesOf = ptm.levels.map((_, n) => Object.values(ptm.rangeOf(n)));
told.levels = await digests(ptm, { engine });
told.asked = [...whole.asked];
told.one = digest(await ptm.image(3, { engine, format: "native" }));
told.noLevel = await settled(ptm.image(99, { engine }));

// A file that is cut after level 4, and within level 5.
const { offset, length } = ptm.rangeOf(4);
const cut = file.slice(0, offset + length + 7);
const cutPtm = await openPtm(ranges(cut).read);
told.cut = await digests(cutPtm, { engine });
told.cutLevel = await settled(cutPtm.image(5, { engine }));

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
told.workers = both;

// Bytes stay whose they were; what is refused can be given again; what is aborted is not lost.
const group = (n) => file.slice(ptm.levels[n].offset, ptm.levels[n].offset + ptm.levels[n].length);
const remote = workers.decoder(ptm.header, { format: "native" });
const bad = group(0);
bad[bad.length - 1] ^= 1;
told.damaged = await settled(remote.refine(bad));
const first = group(0);
told.first = digest(await remote.refine(first));
told.kept = first.length;
const stop = new AbortController();
const going = settled(remote.refine(group(1), { signal: stop.signal }));
stop.abort();
told.aborted = await going;
told.again = digest(await remote.refine(group(1)));
// Several levels in one go, all or until one is damaged; and of a file that is not the expected one.
const ends = ptm.levels.map(({ offset, length }) => offset + length);
const options = { ends, levels: 4, format: "native" };
told.several = (await workers.decodeFirst(file.subarray(0, ends[3]), options)).map(digest);
const spoiled = file.slice();
spoiled[ends[2] - 1] ^= 1;
const refused = await workers.decodeFirst(spoiled, options).catch((error) => error);
const other = await workers.decodeFirst(file, { ...options, ends: ends.slice(1) }).catch((error) => error);
told.refused = [refused.code, refused.decoded, other.code, other.decoded];
// One of two has failed: the other has all the work.
const halved = new DecoderWorkers({ count: 2, create, wasm });
halved.lanes[0].fail(new Error("did not start"));
told.halved = [await digests(ptm, { workers: halved }), await digests(ptm, { workers: halved })];
halved.close();
const busy = workers.decoder(ptm.header, {});
const lane = busy.lane;
const before = workers.decoder(ptm.header, {});
before.lane = lane;
told.before = await settled(before.refine(group(0), { signal: AbortSignal.abort() }));
told.closing = settled(remote.refine(group(2)));
workers.close();
told.closing = await told.closing;
for (const port of ports) port.close();
told.openAborted = await settled(openPtm(whole.read, { signal: AbortSignal.abort() }));
console.log(JSON.stringify(told));
