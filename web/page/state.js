// The numbers of the details panel, also for tests and the console (docs/guide/viewer.md).

import { previews } from "./walk/textures.js";

/** @param {import("./walkthrough.js").Walkthrough} walk */
export function stateOf(walk) {
  const { client, index, memory, needs, picture, rows, stream, stream: { estimate, fetcher } } = walk;
  const { K, memory: bytes } = client.catalogue, levels = new Array(K).fill(0);
  for (const held of memory.held) levels[held]++;
  return {
    cell: walk.cell,
    visible: [...walk.visible],
    drawnCells: picture.drawn.map(({ cell }) => cell).sort((a, b) => a - b),
    residentBytes: memory.bytes,
    peakBytes: memory.peak,
    budgetBytes: walk.budget,
    // As the paper counts.
    paperBytes: memory.held.reduce(
      (sum, held, t) => sum + bytes[t * K + held] / rows[t].channels * index.textures[t].components, 0,
    ),
    geometryBytes: picture.renderer.bytes,
    requests: fetcher.requests,
    bytes: fetcher.bytes + (stream.opening?.bytes ?? 0),
    pending: fetcher.pending,
    complete: walk.complete,
    exact: walk.exact,
    previews: rows.filter((_, t) => previews(walk, t)).length,
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
