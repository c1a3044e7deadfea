// Tables as Python writes them down, as the viewer holds them.

/** The catalogue of a document. */
export function catalogueFrom(report) {
  const { T, C, K, levels, whole, ...tables } = report;
  const stock = { T, C, K, whole, levels: Int32Array.from(levels) };
  for (const [name, rows] of Object.entries(tables)) stock[name] = Float64Array.from(rows.flat());
  return stock;
}
