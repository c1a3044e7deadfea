// The script of sites with a tour.

export { attachTour } from "./tour/tour.js";
