// Exports of the package; see README.md.

export { HEAD_MAX, readHeader } from "./container.js";
export { DECODER_URL, hasSimd, loadEngine } from "./engine.js";
export { PtmError } from "./errors.js";
export { loadViewDecoder, ViewDecoder } from "./meshopt.js";
export { DEFAULT_MEMORY, LevelDecoder, memoryNeeded } from "./level-decoder.js";
export { Ptm, openPtm } from "./open.js";
export { decodePreview } from "./preview.js";
export { serve } from "./serve.js";
export { DecoderWorkers } from "./remote-decoder.js";
