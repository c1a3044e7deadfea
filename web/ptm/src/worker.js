// The script of a worker: new Worker(new URL("worker.js", …), { type: "module" }).

import { serve } from "./serve.js";

serve(/** @type {import("./serve.js").Port} */ (/** @type {unknown} */ (globalThis)));
