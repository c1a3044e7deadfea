// The policies that a visitor can choose from. All but the default are loaded when one is chosen.

import { loadLater } from "../load-later.js";
import { Best } from "./best.js";

/** @typedef {import("./client.js").Client} Client */
/** @typedef {import("./client.js").Policy} Policy */
/**
 * Makes the policy of a client.
 * @typedef {((client: Client) => Policy) & {Memory?: typeof import("../gl/whole-memory.js").WholeMemory}} PolicyMaker
 *   with a texture memory of its own, if it has one
 */

/** @type {Record<string, PolicyMaker>} */
export const POLICIES = { best: (client) => new Best(client) };

/**
 * Whether there is such a policy: then it is among `POLICIES`. Rejects if it cannot be loaded.
 * @param {string} name
 */
export async function loadPolicy(name) {
  if (name === "paper" || name === "whole") {
    const { Paper, Whole, WholeMemory: Memory } = await loadLater();
    POLICIES.paper = (client) => new Paper(client);
    POLICIES.whole = Object.assign((/** @type {Client} */ client) => new Whole(client), { Memory });
  }
  return Object.hasOwn(POLICIES, name);
}
