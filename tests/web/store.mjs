// What a site keeps of files that come in ranges (web/page/offline): a line of JSON for each case.
// node store.mjs PAGE

import { pathToFileURL } from "node:url";

const load = (name) => import(pathToFileURL(`${process.argv[2]}/offline/${name}.js`));
const { Store } = await load("store"), { Visits } = await load("visits");
const URL_OF = "https://site.test/data/a-0123456789.ptm", SIZE = 1000;
const SOUND = URL_OF.replace("ptm", "wav"), LONG = 9 * 2 ** 20;
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
  const asked = [], modes = [], total = file.length;
  return {
    asked,
    modes,
    ask: async (request) => {
      const [, begin, last] = /bytes=(\d+)-(\d*)/.exec(request.headers.get("range") ?? "bytes=0-");
      const span = [Number(begin), last ? Number(last) + 1 : total];
      asked.push(span);
      modes.push(request.mode);
      if (status) return new Response("no", { status });
      const type = { "content-type": "audio/wav", "content-length": String(ranges ? span[1] - span[0] : total) };
      if (!ranges) return new Response(file, { headers: type });
      const headers = { "content-range": `bytes ${span[0]}-${span[1] - 1}/${total}`, ...type };
      return new Response(file.slice(...span), { status: 206, headers });
    },
  };
}

/** The answer to a range, after what goes on behind it. */
async function read(store, begin, end, { cache = "default", url = URL_OF } = {}) {
  const work = [];
  const range = `bytes=${begin}-${end === Infinity ? "" : end - 1}`;
  const request = new Request(url, { headers: { range }, cache });
  const response = await store.answer(request, url, (one) => work.push(one));
  const body = new Uint8Array(await response.arrayBuffer());
  await Promise.all(work);
  const { status } = response, from = status === 200 ? 0 : begin;
  const right = body.every((byte, k) => byte === FILE[from + k]);
  return { status, range: response.headers.get("content-range"), length: body.length, right };
}

const print = (name, row) => console.log(JSON.stringify({ name, ...row }));

/** Reads ranges from a good host with a cache. */
async function reads(name, ranges, options = {}) {
  const { asked, ask, modes } = host(options), cache = shelf(options.room);
  const answers = [];
  for (const [begin, end] of ranges) {
    // Browsers end a worker when they like.
    answers.push(await read(new Store(async () => cache, ask), begin, end, options));
  }
  print(name, { asked, modes, answers, kept: [...cache.rows.keys()].map((key) => key.split("?")[1]) });
}

await reads("twice", [[0, 100], [0, 100]]);
await reads("within", [[0, 100], [100, 300], [50, 250]]);
await reads("longer", [[0, 100], [0, 300]]);
await reads("between", [[0, 100], [200, 300], [0, 300], [0, 300]]);
await reads("whole", [[0, 100], [500, 600]], { ranges: false });
await reads("full", [[0, 100], [100, 200], [0, 200]], { room: 150 });
await reads("down", [[0, 100]], { status: 503 });
await reads("played", [[0, Infinity], [0, Infinity], [700, Infinity], [0, 2]], { url: SOUND });
await reads("player", [[0, 2], [0, 500], [0, 1000], [2, 9]], { url: SOUND });
await reads("long", [[0, Infinity], [0, 2], [0, LONG]], { url: SOUND, file: new Uint8Array(LONG) });
await reads("long whole", [[0, Infinity]], { url: SOUND, file: new Uint8Array(LONG), ranges: false });
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
  const second = await read(new Store(async () => cache, good.ask), 100, 200, { cache: "no-store" });
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
  // A network that answers with a text for scripts and documents.
  const names = { "viewer-0123456789/viewer.js": "text/javascript", "data/index-0123456789.json": "application/json" };
  const cache = shelf(), work = [];
  for (const own of [false, true]) {
    for (const [name, type] of Object.entries(names)) {
      const url = `https://site.test/${name}`, headers = { "content-type": own ? type : "text/plain" };
      const store = new Store(async () => cache, async () => new Response(String(own), { headers }));
      await store.answer(new Request(url), url, (one) => work.push(one));
    }
    await Promise.all(work);
  }
  print("texts", { kept: await Promise.all([...cache.rows.values()].map((one) => one.text())) });
}
const TYPES = { js: "text/javascript", json: "application/json" };
const answerOf = (url, text) =>
  new Response(text, { headers: { "content-type": TYPES[url.split(".").at(-1)] ?? "text/html" } });
const pageOf = (mark) => `<p id="site">data/index-${mark}.json viewer-${mark}/register.js`;
for (const last of ["", " catalogue.html"]) {
  // Two versions, of which the first comes more slowly; a catalogue that the second may not have.
  const scope = "https://site.test/", cache = shelf(), work = [];
  const marks = ["0123456789", "abcdefabcd"], former = pageOf("1111111111");
  const pages = [`${former} catalogue.html`, ...marks.map((mark) => pageOf(mark) + last)]
    .map((html) => `${html} manifest.webmanifest`);
  const ask = async (request) => {
    const url = request.url ?? request;
    if (url === scope) return answerOf(url, pages.shift());
    if (url.includes("catalogue")) return answerOf(url, '<meta name="generator" content="ptmtools">');
    if (url.includes("register") && url.includes(marks[0])) await new Promise((done) => setTimeout(done, 20));
    return url.endsWith("manifest.webmanifest") ? new Response("{}") : answerOf(url, "");
  };
  const visits = new Visits(new Store(async () => cache, ask), scope, async () => {});
  const go = (name = "") => visits.answer(new Request(scope + name), (one) => work.push(one));
  for (const name of ["", "catalogue.html", "catalogue-de.html", "manifest.webmanifest"]) await go(name);
  await Promise.all(work);
  const before = cache.rows.size;
  await go();
  await go();
  await Promise.all(work);
  print(`overlap${last}`, { before, kept: [...cache.rows.keys()].map((key) => key.slice(scope.length)).sort() });
}
{
  // A page sends what it has received after the storage was removed: what the host has, and what is kept then.
  const scope = "https://site.test/", url = `${scope}data/a-0123456789.ptm`, kept = {};
  let cache = null, page = pageOf("0123456789");
  const open = async (create = false) => {
    if (!cache && !create) throw new Error("removed");
    return (cache ??= shelf());
  };
  const { ask } = host(), asked = [];
  const store = new Store(open, async (request) => {
    asked.push(request.url);
    if (/ptm|wav/.test(request.url)) return ask(request);
    if (request.url !== scope) return answerOf(request.url, "");
    return new Response(page, { status: page ? 200 : 503 });
  });
  const visits = new Visits(store, scope, async () => (cache = null));
  const received = { index: "", files: [SOUND], ranged: [{ url, length: 100 }] };
  const keep = async (name) => {
    asked.length = 0;
    await visits.keep(received).catch(() => {});
    kept[name] = [cache ? cache.rows.size : null, asked.filter((one) => /ptm|wav/.test(one)).length];
  };
  await keep("first");
  cache = null;
  await keep("browser");
  page = '<p id="site">';
  await visits.answer(new Request(scope), (one) => (store.work = one));
  await store.work;
  await keep("plain");
  page = "";
  await keep("fault");
  page = pageOf("0123456789");
  await keep("again");
  print("storage", { kept, sound: [...cache.rows.keys()].filter((key) => key.startsWith(`${SOUND}?`)).length });
}
{
  // A new version whose files do not fit, and one that does.
  const scope = "https://site.test/", kept = {};
  for (const room of [300, 3000]) {
    const cache = shelf(room);
    for (const mark of ["0123456789", "abcdefabcd"]) {
      const ask = async ({ url }) => answerOf(url, url === scope ? pageOf(mark) : " ".repeat(50));
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
        String(request.url ?? request).includes("viewer-") ? answerOf(request.url, "js") : ask());
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
    fault: [["", 200, site(1)], ["", 500, "fault"], ["index.html?ui=none", 503, "busy"], ["index", 0], ["?lang=de", 0],
      ["", 429, "many"], ["", 408, "slow"]],
    unknown: [["", 500, "fault"], ["catalogue.html", 0]],
    removed: [["catalogue", 200, page(1)], ["catalogue.html", 0], ["catalogue?x", 0], ["catalogue-de", 0]],
    stays: [["catalogue.html", 200, page(1)], ["", 200, site(1)], ["catalogue", 404, "none"], ["index", 404, "none"],
      ["catalogue", 200, "login"], ["index", 200, site(2)], ["index", 200, '<p id="site">']],
    gone: [["catalogue-de.html", 200, page(1)], ["catalogue-de.html", 410, "gone"]],
    login: [["catalogue.html", 200, page(1)], ["catalogue.html", 200, "login"], ["", 200, "login"],
      ["manifest.webmanifest", 200, "login"], ["catalogue.html", 500, page("fault")],
      ["catalogue.html", 511, "login"]],
    others: [["other.html", 200, page(1)], ["catalogue.html.html", 200, page(1)], ["catalogue/", 200, page(1)],
      ["inner/index.html", 200, site(1)], ["", 200, site(1), "HEAD"]],
  };
  for (const [name, visits] of Object.entries(cases)) print(`document ${name}`, await visit(visits));
}
{
  const { neededBy } = await load("names"), hash = "0123456789", viewer = `viewer-${hash}/viewer.js`;
  const names = [`data/poster-${hash}.jpg`, `data/picture-${hash}.jpg`, `data/opening-${hash}-0.bin`, viewer];
  print("needed", { names: neededBy(names.map((name) => `<a href="https://site.test/${name}">`).join("")) });
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
