// The numbers of the details panel, also for tests and the console (docs/guide/viewer.md).

import { previews } from "./walk/textures.js";

/** @param {import("./walkthrough.js").Walkthrough} walk */
export function stateOf(walk) {
  const { client, memory, needs, picture, stream, stream: { estimate, fetcher } } = walk;
  const levels = new Array(client.catalogue.K).fill(0);
  for (const held of memory.held) levels[held]++;
  return {
    cell: walk.cell,
    visible: [...walk.visible],
    drawnCells: picture.drawn.map(({ cell }) => cell).sort((a, b) => a - b),
    residentBytes: memory.bytes,
    peakBytes: memory.peak,
    budgetBytes: walk.budget,
    paperBytes: paperBytes(walk),
    geometryBytes: picture.renderer.bytes,
    requests: fetcher.requests,
    bytes: fetcher.bytes + (stream.opening?.bytes ?? 0),
    pending: fetcher.pending,
    complete: walk.complete,
    exact: walk.exact,
    previews: walk.rows.filter((_, t) => previews(walk, t)).length,
    fps: picture.fps,
    bandwidth: estimate.bandwidth,
    latency: estimate.latency,
    bufferAge: needs.age,
    policy: walk.policy,
    patience: client.patience.moving,
    dataSaver: stream.saving,
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
