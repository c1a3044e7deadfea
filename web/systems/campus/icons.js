// Icons of points of interest: the names that campus.json may have, 16 by 16 units.

/** Outlines, filled by the even-odd rule. */
const OUTLINES = new Map([
  ["books", "M2 2h3v12H2zM6 2h3v12H6zM10 3l3-1 3 11-3 1z"],
  ["entrance", "M3 1h10v14H3zM5 3v10h6V3zM9 7h1v2H9z"],
  ["food", "M1 4h10v7a3 3 0 0 1-3 3H4a3 3 0 0 1-3-3zM11 5h1.5a2.5 2.5 0 0 1 0 5H11V8.5h1.5a1 1 0 0 0 0-2H11z"],
  ["garden", "M8 1l5 7h-3l3 4H9v3H7v-3H3l3-4H3z"],
  ["info", "M8 1a7 7 0 1 0 0 14A7 7 0 1 0 8 1zM7 7h2v5H7zM7 4h2v2H7z"],
  ["parking", "M4 1h5a4.5 4.5 0 0 1 0 9H7v5H4zM7 4v3h2a1.5 1.5 0 0 0 0-3z"],
]);

const SVG = "http://www.w3.org/2000/svg";

/** What stands before a name: its icon, or nothing without one that the page knows.
 * @param {string | undefined} name @returns {Element[]} */
export function iconOf(name) {
  const outline = OUTLINES.get(name ?? "");
  if (!outline) return [];
  const icon = document.createElementNS(SVG, "svg"), path = document.createElementNS(SVG, "path");
  const attributes = { viewBox: "0 0 16 16", width: "1em", height: "1em", fill: "currentColor", "fill-rule": "evenodd", "aria-hidden": "true", class: "icon" };
  for (const [key, value] of Object.entries(attributes)) icon.setAttribute(key, value);
  path.setAttribute("d", outline);
  icon.append(path);
  return [icon];
}
