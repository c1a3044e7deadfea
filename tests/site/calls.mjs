// What functions of the viewer return, for arguments that Python wrote down: prints a list.

import { readFileSync } from "node:fs";

import { allocate, nextFetch } from "../../web/page/policy/allocation.js";
import { catalogueOf } from "../../web/page/policy/catalogue.js";
import { duration, Estimate } from "../../web/page/policy/estimate.js";
import { weigh } from "../../web/page/relief/weight.js";
import { refresh, shareOut } from "../../web/page/policy/sharing.js";
import {
  directionOf, distance, frustumOf, meetsBox, meetsHull,
} from "../../web/page/space/frustum.js";
import { Locator } from "../../web/client/src/locating.js";
import { stockFrom } from "./typed.mjs";
import { crossing } from "../../web/page/space/portals.js";

const reals = (rows) => Float64Array.from(rows.flat());
const whole = (rows) => Int32Array.from(rows);

const functions = {
  allocate({ worth, cost, last, budget }) {
    const column = whole(last.map(() => 99));
    const used = allocate(reals(worth), reals(cost), whole(last), budget, column);
    return [used, [...column]];
  },
  next({ worth, ends, stored, asked, last, overhead, busy, previews, pending }) {
    const stock = stockFrom({ ends, stored, previews }), T = last.length;
    const requested = (preview) => pending[preview];
    const free = (kind, number) => (kind === "preview" ? !pending[number] : !busy[number]);
    const { density, texture, column, preview } =
      nextFetch(reals(worth), stock, reals(asked), whole(last), overhead, free, requested);
    return [density, ...(preview < 0 ? [texture, column] : [T + preview, 0])];
  },
  share({ memory, levels, have, budget, cells, column, rounds }) {
    const stock = {
      T: levels.length, K: memory[0].length, memory: reals(memory), levels: whole(levels),
    };
    const held = whole(column), report = [];
    for (let round = 0; round < rounds; round++) {
      const share = new Float64Array(stock.T);
      shareOut(stock, cells, held, budget[round], share);
      const asks = refresh(stock, share, whole(have), budget[round], held);
      report.push([[...share], asks, [...held]]);
    }
    return report;
  },
  estimate({ calls, size }) {
    const estimate = new Estimate();
    return calls.map(([name, ...values]) => {
      estimate[name](...values);
      return [estimate.bandwidth, estimate.latency, duration(estimate, size)];
    });
  },
  concurrency({ protocols }) {
    return protocols.map((protocol) => {
      const estimate = new Estimate();
      estimate.protocol = protocol;
      return estimate.concurrency;
    });
  },
  catalogue({ index }) {
    const catalogue = catalogueOf(index);
    weigh(catalogue, index.textures);
    const { levels, T, C, K, whole: all, previews, ...tables } = catalogue;
    const lists = (some) => Object.entries(some).map(([name, table]) => [name, [...table]]);
    const rest = Object.fromEntries(lists(tables)), some = Object.fromEntries(lists(previews));
    return { levels: [...levels], T, C, K, whole: all, previews: some, ...rest };
  },
  frustum({ pose, angle, aspect, low, high, hulls }) {
    const frustum = frustumOf(pose, angle, aspect), far = pose.eye;
    return {
      direction: directionOf(pose.yaw, pose.pitch),
      right: frustum.right,
      up: frustum.up,
      boxes: low.map((corner, i) => meetsBox(frustum, corner, high[i])),
      rows: low.map((_, i) => meetsBox(frustum, reals(low), reals(high), 3 * i)),
      hulls: hulls.map((points) => meetsHull(frustum, reals(points))),
      distances: low.map((corner, i) => distance(far, corner, high[i])),
    };
  },
  locate({ index, records, known, eyes, from }) {
    const locator = new Locator(index.cells.map(({ box }) => box));
    for (const cell of known) locator.learn(cell, records[cell]);
    let cell = from;
    return eyes.map((eye) => {
      const candidates = locator.candidates(eye, cell);
      cell = locator.locate(eye, cell);
      return [cell, candidates];
    });
  },
  around({ records, eyes, cell }) {
    const locator = new Locator(records.map(() => [0, 0, 0, 0, 0, 0]));
    records.forEach((record, number) => locator.learn(number, record));
    return eyes.map((eye) => locator.around(eye, cell));
  },
  crossing({ eye, way, polygon }) {
    return crossing(eye, way, polygon);
  },
};

const calls = JSON.parse(readFileSync(process.argv[2], "utf8"));
const plain = (_, value) => (value === Infinity ? "infinite" : value);
console.log(JSON.stringify(calls.map(([name, report]) => functions[name](report)), plain));
