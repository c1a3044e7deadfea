"""axe-core, which examines a page for barriers (WCAG 2.2)."""

from __future__ import annotations

from typing import Any

from benchmarks.npm import AXE

SCRIPT = AXE.folder / "axe.min.js"
#: Levels A and AA of WCAG 2.2.
_RULES = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"]
_RUN = """(rules) => axe.run(document, { runOnly: rules, resultTypes: ["violations", "passes"] })
  .then(({ violations, passes }) => [passes.length,
    violations.map(({ id, nodes }) => [id, ...nodes.map(({ target }) => target.join(" "))])])"""
#: Text over a picture has to be legible over every picture: the contrast of each text of the
#: interface to its background, drawn over white and over black, the smaller one.
_CONTRAST = """() => {
  const channels = (text) => text.match(/[\\d.]+/g).map(Number);
  const over = (under, [r, g, b, a = 1]) => [r, g, b].map((c, k) => a * c + (1 - a) * under[k]);
  const light = (rgb) => rgb
    .map((c) => (c /= 255) <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4)
    .reduce((sum, c, k) => sum + c * [0.2126, 0.7152, 0.0722][k], 0);
  const stack = (element) => {
    const colors = [];
    for (let e = element; e !== document.body; e = e.parentElement) {
      const color = channels(getComputedStyle(e).backgroundColor);
      if (color[3] !== 0) colors.push(color);
      if (color[3] === undefined || color[3] === 1) break;
    }
    return colors.reverse();
  };
  const rows = [];
  for (const element of document.querySelectorAll("body *")) {
    const own = [...element.childNodes].some((n) => n.nodeType === 3 && n.data.trim());
    if (!own || !element.checkVisibility({ visibilityProperty: true })) continue;
    const backs = stack(element), text = channels(getComputedStyle(element).color).slice(0, 3);
    if (!backs.length) continue;
    const [dark, bright] = [0, 255].map((picture) => {
      const back = backs.reduce(over, [picture, picture, picture]);
      const [a, b] = [light(back), light(text)].sort((x, y) => y - x);
      return (a + 0.05) / (b + 0.05);
    });
    rows.push([Math.min(dark, bright), element.tagName + " " + element.textContent.slice(0, 20)]);
  }
  return rows.sort(([a], [b]) => a - b);
}"""


def barriers(page: Any) -> list[list[str]]:
    """The rules that a page violates, each with the elements."""
    page.evaluate(SCRIPT.read_text())
    passes, violations = page.evaluate(_RUN, _RULES)
    assert passes > 10, "the page was examined"
    rules: list[list[str]] = violations
    return rules


def contrasts(page: Any) -> list[tuple[float, str]]:
    """The contrast of each visible text to its background over the worst picture, least first."""
    return [(row[0], row[1]) for row in page.evaluate(_CONTRAST)]
