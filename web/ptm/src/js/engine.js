// The engine in plain JavaScript, for where there is no WebAssembly with SIMD.

import { decodeHaar } from "./haar.js";
import { decodeRepeats } from "./repeats.js";
import { decodeTexels } from "./texel.js";

/** @type {import("../level-decoder.js").Engine} */
export const plainEngine = {
  name: "js",
  haar: decodeHaar,
  repeats: decodeRepeats,
  texel: decodeTexels,
};
