// Panels end above the buttons, which take two rows where a language has long words or a window is narrow.

const GAP = 12;

/** Keeps the panels above the buttons. @param {ParentNode} root */
export function keepPanelsAboveButtons(root) {
  const nav = root.querySelector("nav");
  const panels = /** @type {HTMLElement | null} */ (root.querySelector("#panels"));
  if (!nav || !panels) return;
  new ResizeObserver(() => {
    // Without buttons (?ui=none) the style of the page stays.
    if (nav.offsetHeight) panels.style.bottom = `${innerHeight - nav.getBoundingClientRect().top + GAP}px`;
  }).observe(nav);
}
