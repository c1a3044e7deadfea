// Finds and creates elements of the page.

/**
 * An element that index.html has.
 * @param {ParentNode} root @param {string} selector @returns {any}
 */
export function find(root, selector) {
  const element = root.querySelector(selector);
  if (!element) throw new Error(`the page has no ${selector}`);
  return element;
}

/**
 * @param {string} tag @param {Record<string, any>} [properties] of the element, or attributes
 * @param {...(Node | string)} children @returns {any}
 */
export function make(tag, properties = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name in element) Reflect.set(element, name, value);
    else element.setAttribute(name, value);
  }
  element.append(...children);
  return element;
}

/** Whether the visitor prefers reduced motion. */
export const calm = () => matchMedia("(prefers-reduced-motion: reduce)").matches;

/** @param {number} bytes of memory */
export const inMemory = (bytes) => `${(bytes / 2 ** 20).toFixed(bytes < 10 * 2 ** 20 ? 1 : 0)} MiB`;

/** @param {number} bytes of files */
export function inBytes(bytes) {
  const unit = bytes < 1e6 ? ["kB", 1e3] : ["MB", 1e6], value = bytes / Number(unit[1]);
  return `${value.toFixed(value < 10 ? 1 : 0)} ${unit[0]}`;
}

/** Adds a style to the page. @param {string} css */
export function addStyle(css) {
  const sheet = new CSSStyleSheet();
  sheet.replaceSync(css);
  document.adoptedStyleSheets = [...document.adoptedStyleSheets, sheet];
}
