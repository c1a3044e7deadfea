// The policies that a visitor can choose from.

import { Best } from "./best.js";
import { Paper } from "./paper.js";

/** @typedef {import("./client.js").Client} Client */
/** @typedef {import("./client.js").Policy} Policy */

/** @type {Record<string, (client: Client) => Policy>} */
export const POLICIES = {
  best: (client) => new Best(client),
  paper: (client) => new Paper(client),
};
