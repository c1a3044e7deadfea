// An opening whose connection falls silent: what of it still comes, and that the rest is given up.

import { Opening } from "../../web/page/net/opening.js";

const whole = Uint8Array.from(JSON.parse(process.argv[2])), until = Number(process.argv[3]);
let waited = 0;
const later = globalThis.setTimeout;
globalThis.setTimeout = (call, milliseconds) => {
  waited = Math.max(waited, milliseconds);
  return later(call, milliseconds / 100);
};
const body = new ReadableStream({
  start(controller) {
    for (let at = 0; at < until; at += 7) controller.enqueue(whole.slice(at, Math.min(at + 7, until)));
  },
});
globalThis.fetch = async () => ({ body });
const opening = new Opening("opening.bin", true);
await opening.next;
const parts = [["record", 3], ["texture", 0], ["preview", 5], ["texture", 9]];
const taken = await Promise.all(parts.map((part) => opening.take(...part)));
// What comes after the parts has been read ahead, or will be.
await new Promise((done) => later(done, 20));
console.log(JSON.stringify({
  taken: taken.map((part) => part && new TextDecoder().decode(part)), bytes: opening.bytes, waited,
}));
