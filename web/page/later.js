// The panels *Map* and *Details*: a script of its own, loaded when one of them is first opened.

export { attachMinimap } from "./ui/minimap.js";
export { attachOverlay } from "./ui/overlay.js";
