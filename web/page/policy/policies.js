// The policies that a visitor can choose from. The paper's is loaded when it is chosen.

import { loadLater } from "../load-later.js";
import { Best } from "./best.js";

/** @typedef {import("./client.js").Client} Client */
/** @typedef {import("./client.js").Policy} Policy */

/** @type {Record<string, (client: Client) => Policy>} */
export const POLICIES = { best: (client) => new Best(client) };

/**
 * Whether there is such a policy: then it is among `POLICIES`. Rejects if it cannot be loaded.
 * @param {string} name
 */
export async function loadPolicy(name) {
  if (name === "paper") {
    const { Paper } = await loadLater();
    POLICIES.paper = (client) => new Paper(client);
  }
  return Object.hasOwn(POLICIES, name);
}
