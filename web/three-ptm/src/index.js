// Exports of the package; see README.md.

export { shareOut } from "./budget.js";
export { CellLoader, disposeCell } from "./cell-loader.js";
export { PtmTexture } from "./ptm-texture.js";
export { RangeFile } from "./range-file.js";
export { Walk } from "./walk.js";
