// What RangeFile makes of servers of several kinds: a line of JSON for each.
// node ranges.mjs ADAPTER

import { pathToFileURL } from "node:url";

const { RangeFile } = await import(pathToFileURL(`${process.argv[2]}/src/range-file.js`));
const FILE = Uint8Array.from({ length: 1000 }, (_, k) => k % 251);
const warned = [];
console.warn = (line) => warned.push(line);
globalThis.setTimeout = (work) => void queueMicrotask(work); // pauses between attempts

/** The answer of a good server to a range. */
function good(begin, end, { whole = false } = {}) {
  const last = Math.min(end, FILE.length - 1);
  if (whole) return new Response(pieces(FILE), { status: 200 });
  if (begin >= FILE.length) {
    const headers = { "content-range": `bytes */${FILE.length}` };
    return new Response(null, { status: 416, headers });
  }
  return answer(begin, last, FILE.subarray(begin, last + 1));
}

function answer(begin, last, body, size = FILE.length) {
  const headers = { "content-range": `bytes ${begin}-${last}/${size}` };
  return new Response(pieces(body), { status: 206, headers });
}

/** In pieces of 64 bytes. */
function pieces(body) {
  const parts = Array.from({ length: Math.ceil(body.length / 64) }, (_, k) =>
    body.slice(64 * k, 64 * k + 64));
  return new ReadableStream({
    pull(controller) {
      const part = parts.shift();
      if (part) controller.enqueue(part);
      else controller.close();
    },
  });
}

/** A connection that breaks. */
const broken = (body, after) => new ReadableStream({
  start(controller) {
    controller.enqueue(body.slice(0, after));
    setTimeout(() => controller.error(new TypeError("connection reset")));
  },
});

/** A connection over which nothing comes any more, until it is called off. */
const stalled = (body, after, signal) => new ReadableStream({
  start(controller) {
    controller.enqueue(body.slice(0, after));
    signal.addEventListener("abort", () => controller.error(signal.reason));
  },
});

/** What reading does with a server, given the number of the request before its answer. */
async function tell(name, serve, work) {
  const asked = [];
  globalThis.fetch = async (url, { headers, cache, signal }) => {
    signal.throwIfAborted();
    const [, begin, end] = /bytes=(\d+)-(\d*)/.exec(headers.range);
    asked.push([Number(begin), end === "" ? null : Number(end), cache]);
    return serve(asked.length - 1, Number(begin), end === "" ? Infinity : Number(end), signal);
  };
  const file = new RangeFile(`http://${name}.test/a.ptm`);
  const read = async (offset, length, signal) => {
    const bytes = await file.read(offset, length, signal);
    const right = bytes.every((byte, k) => byte === FILE[offset + k]);
    return right ? bytes.length : "wrong bytes";
  };
  let got;
  try {
    got = await work({ file, read });
  } catch (error) {
    got = `${error.name}: ${error.message}`;
  }
  console.log(JSON.stringify({ name, got, asked, held: file.held, warned: warned.splice(0) }));
}

const twice = async ({ read }) => [await read(0, 100), await read(50, 200), await read(0, 250)];

await tell("good", (_, begin, end) => good(begin, end), twice);
await tell("ahead", (_, begin, end) => good(begin, end), async ({ file, read }) => {
  file.until = 900;
  return [await read(0, 100), await read(100, 800)];
});
await tell("end", (_, begin, end) => good(begin, end), async ({ read }) =>
  [await read(900, 500), await read(0, 5000)]);
await tell("at-once", (_, begin, end) => good(begin, end), ({ read }) =>
  Promise.all([read(0, 400), read(300, 200), read(600, 400)]));
await tell("whole", () => good(0, 0, { whole: true }), async ({ file, read }) => {
  const first = await read(0, 100);
  await file.settle();
  return [first, await read(500, 500)];
});
await tell("short", (n, begin, end) => n ? good(begin, end)
  : answer(begin, end, FILE.subarray(begin, begin + 70)), ({ read }) => read(0, 200));
await tell("broken", (n, begin, end) => n !== 1 ? good(begin, end)
  : new Response(broken(FILE.subarray(begin), 30), {
    status: 206, headers: { "content-range": `bytes ${begin}-${end}/1000` } }),
  async ({ read }) => [await read(0, 100), await read(100, 100)]);
await tell("down", () => new Response("", { status: 503 }), ({ read }) => read(0, 200));
await tell("recovers", (n, begin, end) => n < 2 ? new Response("", { status: 503 })
  : good(begin, end), ({ read }) => read(0, 200));
await tell("gone", () => new Response("", { status: 404 }), ({ read }) => read(0, 200));
await tell("elsewhere",
  (_, begin, end) => answer(begin + 1, end, FILE.subarray(begin + 1, end + 1)),
  ({ read }) => read(0, 200));
await tell("silent", (_, begin, end) => new Response(FILE.slice(begin, end + 1), { status: 206 }),
  ({ read }) => read(0, 200));
await tell("length", (_, begin, end) => new Response(FILE.slice(begin, end + 1), {
  status: 206,
  headers: { "content-range": `bytes ${begin}-${end}/1000`, "content-length": "7" } }),
  ({ read }) => read(0, 200));
await tell("long", (_, begin, end) => answer(begin, end, FILE.subarray(begin, end + 65)),
  ({ read }) => read(0, 200));
await tell("changed",
  (n, begin, end) => answer(begin, end, FILE.subarray(begin, end + 1), 1000 + n),
  twice);
await tell("forgotten", (n, begin, end) => n ? good(begin, end)
  : answer(begin, end, FILE.slice(begin, end + 1).fill(9, 150)), async ({ file, read }) => {
  const got = [await read(0, 200)];
  file.forget(150);
  return [...got, await read(0, 200)];
});
await tell("called-off", (n, begin, end, signal) => n ? good(begin, end)
  : new Response(stalled(FILE.subarray(begin), 70, signal), {
    status: 206, headers: { "content-range": `bytes ${begin}-${end}/1000` } }),
  async ({ file, read }) => {
    file.until = 900;
    const control = new AbortController();
    const pending = read(0, 100, control.signal).catch((error) => error.name);
    for (let k = 0; k < 100; k++) await undefined;
    control.abort();
    return [await pending, await read(0, 900)];
  });
await tell("settled", (_, begin, end) => good(begin, end), async ({ file, read }) => {
  file.until = 900;
  const first = await read(0, 64);
  await file.settle();
  return [first, await read(0, 128)];
});
