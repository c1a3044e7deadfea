// The search for the largest budget on graphics cards that are made up: prints the result and what was
// tried, of each of the cases.

import { largestBudget } from "../../web/page/policy/budget.js";

const report = [];
for (const { least, most, limit, base, room, slow } of JSON.parse(process.argv[2])) {
  const tried = [];
  const seconds = async (bytes) => {
    tried.push(bytes);
    return base * bytes + slow * Math.max(0, bytes - room);
  };
  report.push([await largestBudget(least, most, limit, seconds), tried]);
}
console.log(JSON.stringify(report));
