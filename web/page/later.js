// The panels, the policy of the paper, and decoding of previews for browsers whose workers cannot: a script
// of its own, loaded when one of them is first needed.

export { Paper } from "./policy/paper.js";
export { attachMenu } from "./ui/menu.js";
export { attachMinimap } from "./ui/minimap.js";
export { attachOverlay } from "./ui/overlay.js";
export { decodePreview } from "../ptm/src/preview.js";
