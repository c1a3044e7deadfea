// Exports of the package; see README.md.

export { levelSizes, withOffset } from "./levels.js";
export { Locator } from "./locating.js";
export { cross, dot, facing, minus } from "./vectors.js";
