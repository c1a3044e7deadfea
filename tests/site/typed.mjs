// Tables as Python writes them down, as the viewer holds them.

/** Tables of files. */
export function stockFrom({ ends, stored, previews: { first, column, bytes, loss } }) {
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
  const { T, C, K, levels, stored, whole, ends, previews, meshes, ...tables } = report;
  const stock = { T, C, K, whole, meshes, levels: Int32Array.from(levels) };
  for (const [name, rows] of Object.entries(tables)) stock[name] = Float64Array.from(rows.flat());
  return Object.assign(stock, stockFrom({ T, ends, stored, previews }));
}
