// Prints what a client answers to walks, each a file, as Python's simulation wrote them down.

import { readFileSync } from "node:fs";

import { replay } from "./replay.mjs";

const answers = [];
for (const file of process.argv.slice(2)) {
  answers.push(await replay(JSON.parse(readFileSync(file, "utf8"))));
}
console.log(JSON.stringify(answers));
