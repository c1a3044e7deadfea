// The levels of octrees among the requests of the policy `best`, with `?octrees=best`: the greatest worth for its
// bytes comes first, as with `best+apo` in simulations. Shares of the view are those of the boxes in it.

import { bestStep } from "../../page/policy/allocation.js";
import { overheadOf, room } from "../../page/policy/best.js";
import { LEAST_DIFFERENCE } from "../../page/policy/constants.js";

/** @typedef {import("./statues.js").Statues} Statues */

/**
 * The levels that are worth most for their bytes, if any is worth something.
 * @param {Statues["wanted"]} wanted
 * @param {import("./statues.js").OctreeRow[]} rows
 * @param {number} overhead bytes of a request besides its own
 */
export function bestLevels(wanted, rows, overhead) {
  let best = { density: 0, number: -1, bytes: 0, end: 0 };
  for (const { number, levels, following, finest, share } of wanted) {
    const { ends, differences } = rows[number];
    const worth = Float64Array.from(ends, (_, k) => share * Math.max(Number(differences?.[k]) || 0, LEAST_DIFFERENCE));
    // The first request brings several levels at once.
    const cost = Float64Array.from(ends, (_, k) => ends[Math.max(k + 1, following) - 1]);
    const paid = levels ? ends[levels - 1] : 0, step = { density: 0, texture: -1, column: 0, preview: -1 };
    bestStep(worth, cost, -1, levels, paid - overhead, finest, step);
    const end = Math.max(step.column, following);
    if (step.density > best.density) best = { density: step.density, number, bytes: ends[end - 1] - paid, end };
  }
  return best;
}

/**
 * Lets levels take the place of requests that are worth less.
 * @param {import("../../page/walkthrough.js").Walkthrough} walk
 * @param {Statues} statues
 */
export function weighLevels(walk, statues) {
  const { client, client: { catalogue: { K, ends }, downloads }, index: { octrees = [] }, stream } = walk;
  const { next } = Object.getPrototypeOf(client);
  /** Beyond the budget of texture memory. @param {import("../../page/policy/downloads.js").Request} request */
  const beyond = ({ kind, number, begin }) => kind === "texture"
    && begin >= ends[number * K + Math.max(client.target[number], client.column[number])];
  // Where the policy makes no more requests, levels come as without the option.
  statues.competes = () => walk.policy === "best" && !stream.rests;
  client.next = (estimate) => {
    if (!statues.competes() || !walk.begun) return next.call(client, estimate);
    while (room(estimate, downloads.waiting)) {
      const request = next.call(client, estimate);
      const { density, number, bytes, end } = bestLevels(statues.wanted, octrees, overheadOf(estimate));
      if (number < 0 || (request && request.priority >= density && !beyond(request))) return request;
      if (request) client.failed(request);
      // So that others see that the link is busy.
      const mine = { kind: /** @type {any} */ ("octree"), number, begin: 0, end: bytes, priority: density, left: bytes };
      downloads.waiting.add(mine);
      statues.load(number, end, mine)?.finally(() => {
        downloads.waiting.delete(mine);
        stream.pump();
      });
    }
    return null;
  };
}
