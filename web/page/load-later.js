/** Loads `later.js`, which the build leaves beside this script. */
export const loadLater = () => import("./later.js");
