// Parts of the page in a script of their own, which is loaded when one of them is first needed: few
// visitors open these panels, and nobody waits for them.

export { attachMinimap } from "./ui/minimap.js";
export { attachOverlay } from "./ui/overlay.js";
