// A walk of a client, as Python's simulation wrote it down: what it saw and received, in that order.

import { Client } from "../../web/page/policy/client.js";
import { loadPolicy, POLICIES } from "../../web/page/policy/policies.js";
import { frustumOf } from "../../web/page/space/frustum.js";
import { catalogueFrom } from "./typed.mjs";

/** What it chose and asked for. */
export async function replay({ catalogue, records, shapes, policy, budget, events, view }) {
  await loadPolicy(policy);
  const client = new Client(catalogueFrom(catalogue), { budget, policy: POLICIES[policy] });
  const asked = [];

  const acts = {
    look({ now, cell, eye, yaw, pitch, still, sight, hidden }) {
      const frustum = frustumOf({ eye, yaw, pitch }, ...view);
      const seen = sight && { sight: Float64Array.from(sight), hidden: Float64Array.from(hidden) };
      client.look({ now, cell, frustum, still, ...seen });
      return [[...client.column], policy === "best" ? client.missing() : null];
    },
    arrived({ number, sight, hidden }) {
      const request = asked[number];
      if (!request) return "nothing";
      if (request.kind === "record") client.learnRecord(request.number, records[request.number]);
      if (request.kind === "geometry") client.learnGeometry(request.number, shapes[request.number]);
      if (sight) client.sees(Float64Array.from(sight), Float64Array.from(hidden));
      client.arrived(request);
      return [...client.have];
    },
    fetch({ bandwidth, latency, left }) {
      for (const [number, bytes] of left) if (asked[number]) asked[number].left = bytes;
      const made = [];
      for (let request; (request = client.next({ bandwidth, latency, concurrency: 6 })); asked.push(request)) {
        const { kind, number, begin, end, priority } = request;
        made.push([kind, number, begin, end, priority]);
      }
      return made;
    },
  };

  return events.map(({ act, ...report }) => acts[act](report));
}
