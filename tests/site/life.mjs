// A client on a link that loses requests, breaks off ranges and sends whole files: prints what must
// never have happened, and how it ended.

import { readFileSync } from "node:fs";

import { Client } from "../../web/page/policy/client.js";
import { loadPolicy, POLICIES } from "../../web/page/policy/policies.js";
import { frustumOf } from "../../web/page/space/frustum.js";
import { catalogueFrom } from "./typed.mjs";

const { catalogue, records, shapes, policy, seed, view } =
  JSON.parse(readFileSync(process.argv[2], "utf8"));
const stock = catalogueFrom(catalogue), { T, C, K } = stock;
await loadPolicy(policy);
const client = new Client(stock, { budget: stock.whole, policy: POLICIES[policy] });
const frustum = frustumOf({ eye: [1, 1.6, 2], yaw: -Math.PI / 2, pitch: 0 }, ...view);
const estimate = { bandwidth: 1e5, latency: 0.1, concurrency: 6 };
let state = 1e6 * seed;
const random = () => (state = (state * 48271) % 2147483647) / 2147483647;

const report = { overlaps: 0, beyond: 0, above: 0, early: 0, failures: 0, again: 0 };
const waiting = [], received = new Float64Array(T), rests = new Map();

/** Seen from the first cell: all textures of what is there, and placeholders of what is not. */
function seen() {
  const sight = new Float32Array(T * K), hidden = new Float32Array(C);
  for (const c of records[0].visible) {
    if (!client.shapes[c] || client.left[c]) hidden[c] = 0.1;
    for (const t of client.left[c] ? [] : client.shapes[c]?.textures ?? []) {
      sight.fill(0.1, t * K + 1, t * K + 1 + stock.levels[t]);
    }
  }
  return { sight, hidden };
}

function settle(request) {
  const { kind, number, begin, end } = request, luck = random();
  if (luck < 0.2) {
    report.failures++;
    rests.set(`${kind} ${number}`, now + 1);
    return client.failed(request, now + 1);
  }
  if (kind === "record") client.learnRecord(number, records[number]);
  if (kind === "geometry") client.learnGeometry(number, shapes[number]);
  if (kind !== "texture") return client.arrived(request);
  const whole = stock.ends[number * K + K - 1];
  const to = luck < 0.3 ? begin + Math.floor((end - begin) / 2) : luck < 0.4 ? whole : end;
  received[number] = Math.max(received[number], to);
  return client.arrived(request, to);
}

let now = 0;
for (let step = 0; step < 4000; step++, now += 0.1) {
  client.budget = step % 7 ? stock.whole : Math.floor(stock.whole * random());
  client.look({ now, cell: 0, frustum, still: true, ...seen() });
  let used = 0;
  for (let t = 0; t < T; t++) {
    if (client.column[t] > client.have[t]) report.beyond++;
    used += stock.memory[t * K + client.column[t]];
  }
  if (used > client.budget) report.above++;
  if (step === 1000) {
    client.forgetGeometry(0);
    report.forgotten = client.missing() > 0;
  }
  for (let request; (request = client.next(estimate)); waiting.push(request)) {
    const { kind, number, begin } = request;
    if (waiting.some((other) => other.kind === kind && other.number === number)) report.overlaps++;
    if (kind === "texture" && begin !== received[number]) report.overlaps++;
    if (now < (rests.get(`${kind} ${number}`) ?? 0)) report.early++;
    if (step >= 1000 && kind === "geometry" && number === 0) report.again++;
  }
  while (waiting.length && random() < 0.7) {
    settle(waiting.splice(Math.floor(random() * waiting.length), 1)[0]);
  }
}
client.budget = stock.whole;
client.look({ now, cell: 0, frustum, still: true, ...seen() });
console.log(JSON.stringify({
  ...report, missing: client.missing(), column: [...client.column], have: [...client.have],
}));
