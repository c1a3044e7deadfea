// <ptm-walk src="https://example.org/site/">: a walk in a page of any origin, in a frame.
//
// Attributes: src, the URL of a published site; title; ui, "none" for a frame without buttons; label and
// stop, where it begins. Events, with details: ptm-ready; ptm-room {cell, name, title}; ptm-label {id}; they
// bubble. Methods: goTo({label | stop | place}), and the walk is fetched when the element comes into view.

const FIELDS = ["ui", "label", "stop", "lang", "memory"];

class PtmWalk extends HTMLElement {
  static observedAttributes = ["src", "title", ...FIELDS];

  constructor() {
    super();
    this.frame = document.createElement("iframe");
    this.frame.loading = "lazy";
    this.frame.allow = "fullscreen; gamepad; xr-spatial-tracking; clipboard-write";
    this.frame.style.cssText = "border:0;width:100%;height:100%;display:block";
    const style = document.createElement("style");
    style.textContent = ":host{display:block;aspect-ratio:16/9;min-height:240px}";
    this.attachShadow({ mode: "open" }).append(style, this.frame);
    /** @type {Promise<void> | undefined} */
    this.pending = undefined;
    this.origin = "*";
    this.hear = (/** @type {MessageEvent} */ event) => {
      const { source, data } = event;
      if (source !== this.frame.contentWindow || data?.format !== "ptm-walk") return;
      const { event: name, ...detail } = data;
      this.dispatchEvent(new CustomEvent(`ptm-${name}`, { detail, bubbles: true, composed: true }));
    };
  }

  connectedCallback() {
    addEventListener("message", this.hear);
  }

  disconnectedCallback() {
    removeEventListener("message", this.hear);
  }

  /** @param {string} name */
  attributeChangedCallback(name) {
    this.frame.title = this.title || "Walk through a building";
    if (name === "title" || !this.hasAttribute("src")) return;
    // Several attributes change at once: the frame is set once.
    this.pending ??= Promise.resolve().then(() => {
      this.pending = undefined;
      const url = new URL(this.getAttribute("src") ?? "", document.baseURI);
      for (const field of FIELDS) {
        const value = this.getAttribute(field);
        if (value !== null) url.searchParams.set(field, value);
      }
      if (!/^https?:$/.test(url.protocol)) return;
      this.origin = url.origin;
      this.frame.src = url.href;
    });
  }

  /**
   * Leads the visitor to a label by its id, a stop of the tour or a viewpoint by its number.
   * @param {{ label?: string, stop?: number, place?: number }} target
   */
  goTo(target) {
    this.frame.contentWindow?.postMessage({ format: "ptm-walk", goTo: target }, this.origin);
  }
}

if (!customElements.get("ptm-walk")) customElements.define("ptm-walk", PtmWalk);
