// Scripts that the build leaves beside this one.

export const loadLater = () => import("./later.js");
export const loadComparison = () => import("./compare.js");
export const loadStatues = () => import("./statues.js");
export const loadReliefs = () => import("./reliefs.js");
export const loadEmbedding = () => import("./embedded.js");
export const loadTour = () => import("./tour.js");
export const loadSets = () => import("./sets.js");
