// What a site keeps of files that come in ranges (web/page/offline): a line of JSON for each case.
// node store.mjs PAGE

import { pathToFileURL } from "node:url";

const load = (name) => import(pathToFileURL(`${process.argv[2]}/offline/${name}.js`));
const { Store } = await load("store"), { Visits } = await load("visits");
const URL_OF = "https://site.test/data/a-0123456789.ptm", SIZE = 1000;
const FILE = Uint8Array.from({ length: SIZE }, (_, k) => k % 251);

/** A cache; `room` bytes fit into it. */
function shelf(room = Infinity) {
  const rows = new Map();
  return {
    rows,
    keys: async () => [...rows.keys()].map((url) => ({ url })),
    match: async (key) => rows.get(key)?.clone(),
    delete: async (key) => rows.delete(key),
    put: async (key, response) => {
      const body = await response.arrayBuffer();
      room -= body.byteLength;
      if (room < 0) throw new DOMException("no room", "QuotaExceededError");
      rows.set(key, new Response(body, { headers: response.headers }));
    },
  };
}

/** A host of the file, and the ranges that it was asked for. */
function host({ ranges = true, file = FILE, status = 0 } = {}) {
  const asked = [], total = file.length;
  return {
    asked,
    ask: async (request) => {
      const [, begin, last] = /bytes=(\d+)-(\d*)/.exec(request.headers.get("range") ?? "bytes=0-");
      const span = [Number(begin), last ? Number(last) + 1 : total];
      asked.push(span);
      if (status) return new Response("no", { status });
      const type = { "content-type": "audio/wav" };
      if (!ranges) return new Response(file, { headers: type });
      const headers = { "content-range": `bytes ${span[0]}-${span[1] - 1}/${total}`, ...type };
      return new Response(file.slice(...span), { status: 206, headers });
    },
  };
}

/** The answer to a range, after what goes on behind it. */
async function read(store, begin, end, cache = "default") {
  const work = [];
  const range = `bytes=${begin}-${end === Infinity ? "" : end - 1}`;
  const request = new Request(URL_OF, { headers: { range }, cache });
  const response = await store.answer(request, URL_OF, (one) => work.push(one));
  const body = new Uint8Array(await response.arrayBuffer());
  await Promise.all(work);
  const { status } = response, from = status === 200 ? 0 : begin;
  const right = body.every((byte, k) => byte === FILE[from + k]);
  return { status, range: response.headers.get("content-range"), length: body.length, right };
}

const print = (name, row) => console.log(JSON.stringify({ name, ...row }));

/** Reads ranges from a good host with a cache. */
async function reads(name, ranges, options = {}) {
  const { asked, ask } = host(options), cache = shelf(options.room);
  const answers = [];
  for (const [begin, end] of ranges) {
    // Browsers end a worker when they like.
    answers.push(await read(new Store(async () => cache, ask), begin, end));
  }
  print(name, { asked, answers, kept: [...cache.rows.keys()].map((key) => key.split("?")[1]) });
}

await reads("twice", [[0, 100], [0, 100]]);
await reads("within", [[0, 100], [100, 300], [50, 250]]);
await reads("longer", [[0, 100], [0, 300]]);
await reads("between", [[0, 100], [200, 300], [0, 300], [0, 300]]);
await reads("whole", [[0, 100], [500, 600]], { ranges: false });
await reads("full", [[0, 100], [100, 200], [0, 200]], { room: 150 });
await reads("down", [[0, 100]], { status: 503 });
await reads("played", [[0, Infinity], [0, Infinity], [700, Infinity], [0, 2]]);
await reads("long", [[0, Infinity]], { file: new Uint8Array(9 * 2 ** 20) });
{
  const cache = shelf(), { ask } = host(), store = new Store(async () => cache, ask);
  await read(store, 0, Infinity);
  const request = new Request(URL_OF, { headers: { range: "bytes=5-" } });
  print("type", { type: (await store.answer(request, URL_OF, () => {})).headers.get("content-type") });
}

{
  // Damaged on the way; the page notices it, and asks past caches.
  const cache = shelf(), bad = host({ file: FILE.map((byte) => byte ^ 1) }), good = host();
  const first = await read(new Store(async () => cache, bad.ask), 0, 300);
  const second = await read(new Store(async () => cache, good.ask), 100, 200, "no-store");
  const third = await read(new Store(async () => cache, good.ask), 100, 200);
  print("damaged", { answers: [first, second, third], asked: good.asked, kept: [...cache.rows.keys()].length });
}
{
  // The browser has emptied the cache meanwhile.
  const cache = shelf(), { asked, ask } = host(), store = new Store(async () => cache, ask);
  await read(store, 0, 100);
  cache.rows.clear();
  print("emptied", { answers: [await read(store, 0, 100), await read(store, 0, 100)], asked });
}
{
  // Without a network.
  const cache = shelf(), { ask } = host();
  await read(new Store(async () => cache, ask), 0, 100);
  const lost = new Store(async () => cache, async () => Promise.reject(new TypeError("no network")));
  const beyond = await read(lost, 50, 150).catch((fault) => String(fault));
  print("lost", { answers: [await read(lost, 20, 80)], beyond });
}
{
  // Storage that fails altogether.
  const { ask } = host(), broken = async () => Promise.reject(new DOMException("broken", "UnknownError"));
  const store = new Store(broken, ask);
  const answers = [await read(store, 0, 100), await read(store, 0, 100)];
  const whole = await store.answer(new Request(URL_OF), URL_OF, () => {});
  print("broken", { answers, whole: whole.status });
}
{
  // A host that answers with a page for a file that it lacks.
  const cache = shelf(), headers = { "content-type": "text/html; charset=utf-8" }, work = [];
  const store = new Store(async () => cache, async () => new Response("<html>", { headers }));
  await read(store, 0, 6);
  await store.answer(new Request(URL_OF), URL_OF, (one) => work.push(one));
  await Promise.all(work);
  print("page", { kept: cache.rows.size });
}
{
  // A new version whose files do not fit, and one that does.
  const scope = "https://site.test/", kept = {};
  for (const room of [300, 3000]) {
    const cache = shelf(room);
    for (const mark of ["0123456789", "abcdefabcd"]) {
      const html = `<p id="site">data/index-${mark}.json viewer-${mark}/register.js`;
      const ask = async (request) => new Response((request.url ?? request) === scope ? html : " ".repeat(50));
      const work = [];
      await new Visits(new Store(async () => cache, ask), scope, async () => {})
        .answer(new Request(scope), (one) => work.push(one));
      await Promise.all(work);
    }
    const [last] = (await cache.match(scope).then((one) => one.text())).match(/[0-9a-f]{10}/);
    kept[room] = [last, cache.rows.has(`${scope}data/index-${last}.json`)];
  }
  print("versions", { kept });
}
{
  // Documents: what the visitor gets in turn, and what is kept in the end.
  const scope = "https://site.test/walk/", page = (text) => `<meta name="generator" content="ptmtools">${text}`;
  const site = (text) => `<p id="site">viewer-0123456789/register.js ${text}`;
  // Address, status (0: no network) and text of the host.
  const visit = async (visits) => {
    const cache = shelf(), texts = [];
    for (const [address, status, text, method] of visits) {
      const ask = async () => {
        if (!status) throw new TypeError("no network");
        return new Response(text, { status, headers: { "content-type": "text/html" } });
      };
      // Files that the page names are here.
      const store = new Store(async () => cache, async (request) =>
        String(request.url ?? request).includes("viewer-") ? new Response("js") : ask());
      const work = [], request = new Request(scope + address, { method });
      const answer = new Visits(store, scope, async () => {}).answer(request, (one) => work.push(one));
      texts.push(answer && await answer.then((one) => one.text(), String));
      await Promise.all(work);
    }
    const kept = [...cache.rows].filter(([key]) => !key.includes("viewer-"));
    return { texts, kept: Object.fromEntries(await Promise.all(kept.map(async ([key, row]) =>
      [key.slice(scope.length), await row.text()]))) };
  };
  const cases = {
    fault: [["", 200, site(1)], ["", 500, "fault"], ["index.html?ui=none", 503, "busy"], ["index", 0], ["?lang=de", 0]],
    unknown: [["", 500, "fault"], ["catalogue.html", 0]],
    removed: [["catalogue", 200, page(1)], ["catalogue.html", 0], ["catalogue?x", 0], ["catalogue-de", 0]],
    stays: [["catalogue.html", 200, page(1)], ["", 200, site(1)], ["catalogue", 404, "none"], ["index", 404, "none"],
      ["catalogue", 200, "login"], ["index", 200, site(2)], ["index", 200, '<p id="site">']],
    gone: [["catalogue-de.html", 200, page(1)], ["catalogue-de.html", 410, "gone"]],
    login: [["catalogue.html", 200, page(1)], ["catalogue.html", 200, "login"], ["", 200, "login"],
      ["manifest.webmanifest", 200, "login"], ["catalogue.html", 500, page("fault")]],
    others: [["other.html", 200, page(1)], ["catalogue.html.html", 200, page(1)], ["catalogue/", 200, page(1)],
      ["inner/index.html", 200, site(1)], ["", 200, site(1), "HEAD"]],
  };
  for (const [name, visits] of Object.entries(cases)) print(`document ${name}`, await visit(visits));
}
{
  // Any ranges in any order: the answers are right, and no byte that is kept is asked for at an end of a range.
  let seed = 1;
  const random = (n) => (seed = (seed * 48271) % 2147483647) % n;
  const has = new Set(), cache = shelf(), { asked, ask } = host();
  let wrong = 0, needless = 0;
  for (let k = 0; k < 400; k++) {
    const begin = random(SIZE - 1), end = begin + 1 + random(Math.min(200, SIZE - begin - 1) + 1);
    const before = asked.length;
    const answer = await read(new Store(async () => cache, ask), begin, Math.min(end, SIZE));
    wrong += !answer.right || answer.length !== Math.min(end, SIZE) - begin;
    for (const [a, b] of asked.slice(before)) {
      needless += has.has(a) || has.has(b - 1);
      for (let byte = a; byte < b; byte++) has.add(byte);
    }
  }
  print("random", { wrong, needless, requests: asked.length });
}
