// The numbers of the details panel, also for tests and the console (docs/guide/viewer.md).

import { previews } from "./walk/textures.js";

/** @param {import("./walkthrough.js").Walkthrough} walk */
export function stateOf(walk) {
  const { client, estimate, fetcher, memory } = walk;
  const levels = new Array(walk.catalogue.K).fill(0);
  for (const held of memory.held) levels[held]++;
  return {
    cell: walk.cell,
    visible: [...walk.visible],
    drawnCells: walk.drawn.map(({ cell }) => cell).sort((a, b) => a - b),
    residentBytes: memory.bytes,
    peakBytes: memory.peak,
    budgetBytes: walk.budget,
    paperBytes: paperBytes(walk),
    geometryBytes: walk.renderer?.bytes ?? 0,
    requests: fetcher.requests,
    bytes: fetcher.bytes,
    pending: fetcher.pending,
    complete: walk.complete,
    exact: walk.exact,
    previews: walk.rows.filter((_, t) => previews(walk, t)).length,
    fps: walk.fps,
    bandwidth: estimate.bandwidth,
    latency: estimate.latency,
    bufferAge: walk.bufferAge,
    policy: walk.policy,
    patience: client.patience.moving,
    dataSaver: walk.saving,
    levels,
    held: Array.from(memory.held),
  };
}

/** Bytes in texture memory, as the paper counts. @param {import("./walkthrough.js").Walkthrough} walk */
function paperBytes({ index, rows, memory }) {
  return index.textures.reduce((sum, { components }, t) => {
    const texels = rows[t].sizes.slice(0, memory.held[t]);
    return sum + components * texels.reduce((all, { width, height }) => all + width * height, 0);
  }, 0);
}
