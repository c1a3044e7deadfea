// The order in which levels of one octree and of one texture are requested with `?octrees=best`, of each of the
// cases: `[whether of the octree, levels that are there then]`. One request is under way at a time.

import { weighLevels } from "../../web/systems/octree/weighing.js";
import { Best } from "../../web/page/policy/best.js";
import { catalogueOf } from "../../web/page/policy/catalogue.js";
import { Client } from "../../web/page/policy/client.js";

const estimate = { bandwidth: 1e6, latency: 0, concurrency: 1 };
const record = { adjacent: [], visible: [0], ach: [1], floor: 0, textures: [[0]], leaves: [], portals: [] };

/** @param {{texture: any, octree: any, sight: number, share: number, there: number}} one */
async function orderOf({ texture, octree, sight, share, there }) {
  const side = 2 ** (texture.ends.length - 1);
  const row = { ...texture, width: side, height: side, gpuTexelBytes: 4, color: [0, 0, 0] };
  const cell = { box: [0, 0, 0, 1, 1, 1], recordBytes: 1000, geometryBytes: 4000 };
  const catalogue = catalogueOf({ textures: [row], cells: [cell] });
  const client = new Client(catalogue, { budget: 1e9, policy: (some) => new Best(some) });
  const order = [], count = octree.ends.length;
  let levels = there;
  const statues = {
    competes: () => false,
    get wanted() {
      return levels < count ? [{ number: 0, levels, following: levels + 1, finest: count, share }] : [];
    },
    load: async (_, end) => order.push([true, levels = end]),
  };
  const stream = { rests: false, pump() {} };
  weighLevels({ client, stream, policy: "best", begun: true, index: { octrees: [octree] } }, statues);
  client.learnRecord(0, record);
  client.learnGeometry(0, [{ texture: 0, low: [0, 0, 0], high: [1, 1, 1] }]);
  client.look({
    now: 0, cell: 0, frustum: { eye: [0, 0, 0], planes: [] },
    sight: new Float64Array(catalogue.K).fill(sight, 1), hidden: new Float64Array(1),
  });
  for (let before = -1; order.length > before; await new Promise((resolve) => setTimeout(resolve))) {
    before = order.length;
    const request = client.next(estimate);
    if (!request) continue;
    client.arrived(request);
    order.push([false, client.have[0]]);
  }
  return order;
}

console.log(JSON.stringify(await Promise.all(JSON.parse(process.argv[2]).map(orderOf))));
