// How long the viewer's client takes to look around, to choose its next request and to say what is
// missing, in milliseconds of processor time: node benchmarks/viewer_policy.mjs

import { Client } from "../ptmtools/viewer/page/policy/client.js";
import { POLICIES } from "../ptmtools/viewer/page/policy/policies.js";
import { frustumOf } from "../ptmtools/viewer/page/space/frustum.js";

const CELLS = 60, LEVELS = 11, SEEN = 40, RUNS = 100, REQUESTS = 20;
let state = 1;
const random = () => (state = (state * 48271) % 2147483647) / 2147483647;

/** A row of rooms of 4 m, 40 shapes in each. */
function walk(T, policy) {
  const K = LEVELS + 1, C = CELLS;
  const filled = (length, value) => Float64Array.from({ length }, (_, i) => value(i));
  const table = (value) => filled(T * K, (i) => (i % K ? value(i % K) : 0));
  const corner = (dx) => filled(3 * C, (i) => (i % 3 ? dx : 4 * Math.floor(i / 3) + dx));
  const stock = {
    T, C, K, levels: new Int32Array(T).fill(LEVELS),
    ends: table((k) => 4 ** k), memory: table((k) => 5 * 4 ** k),
    differences: table(() => 9 * random()),
    colors: new Float64Array(3 * T), low: corner(0), high: corner(4),
    recordBytes: new Float64Array(C).fill(900), geometryBytes: new Float64Array(C).fill(4000),
    whole: T * 5 * 4 ** LEVELS,
  };
  const client = new Client(stock, { budget: stock.whole / 10, policy: POLICIES[policy] });
  const cells = Array.from({ length: C }, (_, c) => c);
  for (const c of cells) {
    const points = [[4 * c, 0, 0], [4 * c + 4, 3, 4]];
    client.learnRecord(c, {
      adjacent: cells.filter((n) => Math.abs(n - c) === 1),
      visible: [c, ...cells.filter((n) => n !== c)],
      ach: cells.map(() => 1 / C), floor: 1e-4, textures: [[...Array(T).keys()]],
      need: Array.from({ length: T }, (_, t) => [t, 3, 0.01, 0.005, 0.002]),
      leaves: [{ points, faces: [] }], portals: [],
    });
    client.learnGeometry(c, Array.from({ length: 40 }, () => {
      const low = [4 * c + 3 * random(), 2 * random(), 3 * random()];
      return { texture: Math.floor(T * random()), low, high: low.map((x) => x + random()) };
    }));
  }
  const estimate = { bandwidth: 4e6, latency: 0.1 }, times = { look: [], next: [], missing: [] };
  for (let run = 0; run < RUNS; run++) {
    const sight = new Float32Array(T * K), eye = [4 + run / 5, 1.6, 2];
    for (let n = 0; n < SEEN; n++) {
      const row = ((n * 7 + run) % T) * K;
      sight.fill(random() / SEEN, row + 1, row + 9);
    }
    const frustum = frustumOf({ eye, yaw: -Math.PI / 2, pitch: 0 }, 1, 1.8);
    const timed = (name, act) => {
      const start = process.cpuUsage(), found = act();
      times[name].push(process.cpuUsage(start).user / 1000);
      return found;
    };
    timed("look", () => client.look({
      now: run / 5, cell: Math.floor(eye[0] / 4), frustum, sight, hidden: new Float32Array(C),
    }));
    for (let n = 0; n < REQUESTS; n++) {
      const request = timed("next", () => client.next(estimate));
      if (request) client.arrived(request);
    }
    timed("missing", () => client.missing());
  }
  return times;
}

const median = (some) => some.sort((a, b) => a - b)[some.length >> 1].toFixed(2);
for (const policy of Object.keys(POLICIES)) {
  for (const T of [31, 200, 2000]) {
    const times = Object.entries(walk(T, policy));
    const figures = times.map(([name, some]) => `${name} ${median(some)}`);
    console.log(`${policy}, ${T} textures: ${figures.join(", ")}`);
  }
}
