// Scripts that the build leaves beside this one; two are of packages that attach (web/systems).

export const loadLater = () => import("./later.js");
export const loadComparison = () => import("./compare.js");
/** @type {() => Promise<typeof import("../systems/statues.js")>} */
// @ts-expect-error -- it is not beside its source
export const loadStatues = () => import("./statues.js");
export const loadLight = () => import("./light.js");
export const loadReliefs = () => import("./reliefs.js");
export const loadEmbedding = () => import("./embedded.js");
export const loadTour = () => import("./tour.js");
/** @type {() => Promise<typeof import("../systems/sets.js")>} */
// @ts-expect-error -- as above
export const loadSets = () => import("./sets.js");
