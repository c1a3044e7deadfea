// Prints what a client answers to a walk as Python's simulation wrote it down.

import { readFileSync } from "node:fs";

import { replay } from "./replay.mjs";

console.log(JSON.stringify(await replay(JSON.parse(readFileSync(process.argv[2], "utf8")))));
