// The script of sites with a tour.

export { addTourStyle, attachTour, Tour } from "./tour/tour.js";
