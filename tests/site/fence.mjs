// A fence on a simulated GPU: what it reports after each step.

import { Fence } from "../../web/page/gl/fence.js";

const SIGNALED = 1, made = [], deleted = [];
let reached = false;
const gl = {
  SIGNALED, SYNC_STATUS: 2, SYNC_GPU_COMMANDS_COMPLETE: 3,
  fenceSync: () => (made.push(made.length), { number: made.length }),
  deleteSync: (sync) => sync && deleted.push(sync.number),
  getSyncParameter: () => (reached ? SIGNALED : 0),
  flush: () => {},
};
const fence = new Fence(gl), reports = [];
const report = (answer) => reports.push([answer, fence.busy, Math.round(1000 * fence.took)]);
report(fence.reached(1));
fence.mark(1);
report(fence.reached(1.05));
reached = true;
report(fence.reached(1.1));
report(fence.reached(1.2));
reached = false;
fence.mark(2);
fence.mark(3);
reached = true;
report(fence.reached(3.02));
fence.mark(4);
report(fence.reached(600));
console.log(JSON.stringify({ reports, left: made.length - deleted.length }));
