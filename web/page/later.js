// The panels, the policies besides the default, the measurement of texture memory, and what browsers need that
// cannot copy a link, or decode previews in workers: a script of its own, loaded when one of them is first needed.

import { keepPanelsAboveButtons } from "./ui/above.js";
import { addStyle } from "./ui/elements.js";
import { PANEL_STYLE } from "./ui/panel-style.js";

export { WholeMemory } from "./gl/whole-memory.js";
export { measureBudget } from "./measuring.js";
export { Paper } from "./policy/paper.js";
export { Whole } from "./policy/whole.js";
export { attachHelp } from "./ui/help.js";
export { showLink } from "./ui/link.js";
export { attachMenu } from "./ui/menu.js";
export { attachMinimap } from "./ui/minimap.js";
export { attachOverlay } from "./ui/overlay.js";
export { decodePreview } from "../ptm/src/preview.js";

// The policies also run without a page.
if (typeof document === "object") {
  addStyle(PANEL_STYLE);
  keepPanelsAboveButtons(document);
}
