// Tables as Python writes them down, as the viewer holds them.

import { gainsOf } from "../../web/page/policy/catalogue.js";

/** Tables of files, with previews if there are any. */
export function stockFrom({ T, ends, stored, previews = {} }) {
  const { first = new Array(T + 1).fill(0), column = [], bytes = [], loss = [] } = previews;
  return {
    ends: Float64Array.from(ends.flat()),
    stored: Int32Array.from(stored),
    previews: {
      first: Int32Array.from(first), column: Int32Array.from(column),
      bytes: Float64Array.from(bytes), loss: Float64Array.from(loss),
    },
  };
}

/** The catalogue of a document. */
export function catalogueFrom(report) {
  const { T, C, K, levels, stored = levels, whole, ends, previews, ...tables } = report;
  const stock = { T, C, K, whole, levels: Int32Array.from(levels) };
  for (const [name, rows] of Object.entries(tables)) stock[name] = Float64Array.from(rows.flat());
  Object.assign(stock, stockFrom({ T, ends, stored, previews }));
  stock.gains = gainsOf(stock.differences, K, stock.previews);
  return stock;
}
