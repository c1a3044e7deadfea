// Makes elements of the trees of texts. Only these kinds become elements; all else is text.

import { make } from "../ui/elements.js";

/** @type {Record<string, string>} */
const ELEMENTS = {
  p: "p", h: "h3", em: "em", strong: "strong", code: "code", ul: "ul", ol: "ol", li: "li",
  quote: "blockquote", br: "br",
};
const SAFE = /^(https?|mailto):/i;
/** Deeper nodes are left out: the build writes none. */
const DEEPEST = 32;

/** @param {string} address */
export const isSafe = (address) => SAFE.test(address);

/**
 * @param {any} nodes
 * @param {number} [depth]
 * @returns {(Node | string)[]}
 */
export function elementsOf(nodes, depth = 0) {
  if (!Array.isArray(nodes) || depth > DEEPEST) return [];
  return nodes.map((node) => {
    if (!Array.isArray(node)) return String(node);
    const [kind, ...children] = node;
    if (kind === "a") {
      const [href, ...inside] = children, parts = elementsOf(inside, depth + 1);
      if (!isSafe(String(href))) return make("span", {}, ...parts);
      return make("a", { href: String(href), target: "_blank", rel: "noopener" }, ...parts);
    }
    const name = Object.hasOwn(ELEMENTS, kind) ? ELEMENTS[kind] : "span";
    return make(name, {}, ...elementsOf(children, depth + 1));
  });
}
