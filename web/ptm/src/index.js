// What the package offers: see README.md.

export { HEAD_MAX, readHeader } from "./container.js";
export { PtmError } from "./errors.js";
export { DEFAULT_MEMORY, LevelDecoder, memoryNeeded } from "./level-decoder.js";
export { DECODER_URL, loadEngine } from "./load-engine.js";
export { Ptm, openPtm } from "./open.js";
export { serve } from "./serve.js";
export { DecoderWorkers } from "./workers.js";
