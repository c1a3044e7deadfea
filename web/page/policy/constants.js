// Written by web/page/build.py from ptmtools/site/client.json.

/** Error of a pixel without geometry, 0 to 255: the measured mean. */
export const NOTHING = 64;
/** Least distance, metres: nearer shapes count as this far. */
export const NEAREST = 0.5;
/** Weight of what is out of sight. */
export const BEHIND = 0.2;
/** Weight of a cell that is seen only from a neighbouring cell. */
export const BEYOND = 0.05;
/** Least difference of a level or a preview, 0 to 255: a level that only repeats the texels of the coarser one still sharpens the filtering between them. */
export const LEAST_DIFFERENCE = 0.5;
/** Share of the error of an image that is left when it is halved. */
export const AVERAGING = 0.5;
/** Weight of normal maps: they come after the colours. */
export const NORMALS = 0.25;
/** Error of a mesh by its distance that can be seen. */
export const SEEN = 0.0005;
/** Error of a mesh by its distance that counts half as much as a pixel without geometry. */
export const GROSS = 0.05;
/** Weight of the surroundings beside the screen; anything from a twentieth to a half does. */
export const SURROUNDINGS = 0.1;
/** Part of that weight in the choice for texture memory. */
export const HELD = 0.1;
/** Share of its worth at which a level stays that is no longer wanted. */
export const HELD_ON = 0.001;
/** Half-life of that worth, s. */
export const HELD_SECONDS = 7;
/** Worth of the record of a neighbouring cell, as a share of the screen. */
export const RECORD_SHARE = 0.005;
/** Length of a range, seconds of the link. */
export const RANGE_SECONDS = 0.2;
/** Least bytes of a range. */
export const RANGE_BYTES = 8000;
/** Bytes of the headers of a request. */
export const OVERHEAD = 300;
/** Greatest cost of waiting, bytes, on links without a limit. */
export const LONGEST_WAIT = 1048576;
/** Requests at a time: connections of a browser to a host. */
export const CONNECTIONS = 6;
/** Requests at a time on a connection of HTTP/2 or 3. */
export const STREAMS = 24;
/** Bandwidth before the first downloads, bit/s. */
export const PRIOR_BANDWIDTH = 1000000;
/** Latency before the first downloads, s. */
export const PRIOR_LATENCY = 0.1;
/** Half-life of arrived bytes, seconds of arrival. */
export const HALF_LIFE = 1;
/** With fewer bytes, and fewer seconds than the next value, the bandwidth is the prior one. */
export const ENOUGH_BYTES = 16384;
/** See the value before. */
export const ENOUGH_SECONDS = 0.25;
/** Number of latencies in the mean. */
export const LATENCIES = 8;
/** Time between choices of a client, s, unless something has arrived. */
export const LOOK_SECONDS = 0.2;
/** Pixels of the item buffer of a page, whatever the aspect of its screen: 80 by 45 on most. */
export const ITEM_PIXELS = 3600;
/** A visitor stands if this long, s, he has moved and turned no farther than the next two values. */
export const STILL_SECONDS = 1;
/** See the value before. */
export const STILL_METRES = 0.001;
/** See the values before. */
export const STILL_DEGREES = 1;
/** Policy of the paper: greatest time for a level while the eye moves, s. */
export const PATIENCE = 0.5;
/** Policy of the paper: greatest time for a level while the eye stands, s. */
export const PATIENCE_STILL = 20;
/** Policy of the paper: past motion that is extrapolated, s. */
export const BEFORE = 0.5;
/** Policy of the paper: how far ahead, s. */
export const AHEAD = 2;
/** Policy gpuii: width of a ring around the eye, m. Narrower rings make worse pictures, wider ones are not better everywhere. */
export const RING = 8;
/** Campuses: number of the nearest objects in high detail (the paper's IV). */
export const CAMPUS_NEAREST = 8;
/** Campuses: downloads at a time; the paper states none. */
export const CAMPUS_THREADS = 4;
/** Campuses: movement of the eye, m, after which objects are sorted again; the paper states none. */
export const CAMPUS_MOVE = 2;
