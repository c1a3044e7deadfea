// node gltf_validator.cjs MODULE FOLDER: what the Khronos glTF validator says of every GLB in a
// folder, as JSON: {file: {issues: [[severity, code, message, pointer]], triangles, resources}}.
"use strict";
const fs = require("fs");
const path = require("path");

const [moduleFolder, folder] = process.argv.slice(2);
const validator = require(path.resolve(moduleFolder));

const load = (uri) =>
  fs.promises.readFile(path.resolve(folder, decodeURIComponent(uri))).then((b) => new Uint8Array(b));

(async () => {
  const found = {};
  for (const name of fs.readdirSync(folder).filter((n) => n.endsWith(".glb")).sort()) {
    const bytes = new Uint8Array(fs.readFileSync(path.join(folder, name)));
    const options = { uri: name, maxIssues: 0, externalResourceFunction: load };
    const report = await validator.validateBytes(bytes, options);
    const info = report.info ?? {}; // absent if the bytes are no glTF at all
    found[name] = {
      issues: report.issues.messages.map((m) => [m.severity, m.code, m.message, m.pointer ?? ""]),
      triangles: info.totalTriangleCount ?? 0,
      resources: (info.resources ?? []).filter((r) => r.storage === "external" && r.image).length,
    };
  }
  console.log(JSON.stringify(found));
})();
