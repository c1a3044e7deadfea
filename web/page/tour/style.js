// The style of markers and labels, which pages without a tour do not have.

export const STYLE = `
#markers { position: fixed; inset: 0; pointer-events: none; overflow: hidden; }
#markers button { position: absolute; left: 0; top: 0; width: 44px; min-height: 44px; height: 44px; margin: -22px; padding: 0; border: 0; border-radius: 50%; background: none; pointer-events: auto; }
#markers button::before { content: ""; position: absolute; inset: 11px; border: 2px solid #16171b; border-radius: 50%; background: var(--ink); box-shadow: 0 0 0 2px #fffc, 0 2px 8px #000a; }
#markers button:hover::before, #markers button:focus-visible::before, #markers [aria-current]::before { background: var(--warm); inset: 8px; }
#markers button:focus-visible { outline-offset: -2px; }
#tour, #label { margin-inline-start: auto; }
#tour ol { list-style: none; margin: 0; padding: 0; display: grid; gap: 6px; }
#tour li button { width: 100%; text-align: start; padding: 8px 12px; background: #ffffff0d; }
#tour li small { display: block; color: var(--dim); font-size: 13px; }
#tour [aria-current] { border-color: var(--warm); }
#tour select { width: 100%; margin: 0 0 10px; }
#label h2 { font-size: 20px; line-height: 1.25; margin: 0 0 4px; display: flow-root; }
#label h3 { color: inherit; font-size: 15px; }
#label .by { color: var(--dim); margin: 0 0 10px; }
#label p, #label li { max-width: 65ch; }
#label blockquote { margin: 8px 0; padding-inline-start: 12px; border-inline-start: 3px solid var(--line); }
#label audio { width: 100%; margin: 8px 0 0; }
#label .captions { min-height: 3em; margin: 6px 0 0; padding: 8px 10px; background: #000; border-radius: 8px; }
#label .captions:empty { display: none; }
#label .close { float: inline-end; width: 44px; padding: 0; margin: -4px 0 0; margin-inline: 8px -6px; }
#label details summary { min-height: 32px; cursor: pointer; color: var(--dim); }
@media (forced-colors: active) { #tour [aria-current] { border: 3px solid Highlight; } #markers button::before { border-color: CanvasText; forced-color-adjust: none; } }
`;
