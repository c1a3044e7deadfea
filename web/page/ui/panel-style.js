// The style of the panels, and of what else is loaded when it is first needed.

export const PANEL_STYLE = `
#notices input { font: 13px ui-monospace, monospace; width: 100%; min-height: 36px; margin-top: 6px; padding: 0 8px; color: inherit; background: #0006; border: 1px solid var(--line); border-radius: 6px; pointer-events: auto; }
#halves { position: fixed; inset: 0; margin: 0; display: flex; direction: ltr; pointer-events: none; text-align: center; }
#halves b { flex: 1; padding-top: max(14px, env(safe-area-inset-top)); font-weight: 600; text-shadow: 0 0 4px #000, 0 1px 8px #000; }
#halves b + b { border-left: 2px solid var(--warm); }

dl { display: grid; grid-template-columns: auto 1fr; gap: 6px 14px; margin: 0; }
dt { color: var(--dim); }
dd { margin: 0; }
kbd { font: 12px/1 ui-monospace, monospace; color: var(--ink); padding: 2px 6px; border: 1px solid var(--line); border-radius: 5px; }

#places ol { list-style: none; margin: 0; padding: 0; display: grid; gap: 6px; }
#places ol button { width: 100%; min-height: 56px; padding: 6px 10px; display: flex; gap: 12px; align-items: center; text-align: start; background: #ffffff0d; }
#places img { width: 80px; height: 45px; object-fit: cover; border-radius: 6px; background: var(--line); flex: none; }
#places [aria-current] { border-color: var(--warm); }

#map canvas { display: block; width: 100%; }
#map h2 span { color: var(--dim); font-weight: 400; float: inline-end; }
.key { margin: 10px 0 0; color: var(--dim); font-size: 13px; }
.key span { margin-inline-end: 14px; }
.key span::before { content: ""; display: inline-block; width: 10px; height: 10px; margin-inline-end: 6px; border-radius: 3px; background: var(--color); }

#details { font-size: 14px; font-variant-numeric: tabular-nums; }
#memory { margin: 0 0 6px; }
#details dl { margin-top: 12px; }
#details dd { text-align: end; }
.bars { display: flex; gap: 3px; margin: 0; font-size: 11px; color: var(--dim); text-align: center; }
.bars span { flex: 1; padding-top: 44px; background: linear-gradient(var(--warm) 0 0) 0 calc(44px * (1 - var(--share))) / 100% calc(44px * var(--share)) no-repeat; background-origin: border-box; }
#details label { display: flex; flex-wrap: wrap; justify-content: space-between; align-items: center; gap: 0 8px; min-height: 44px; }
label span { color: var(--dim); }
input[type="range"] { flex: 1 0 100%; height: 28px; margin: 0; accent-color: var(--warm); }
input[type="checkbox"] { width: 22px; height: 22px; margin: 0; accent-color: var(--warm); }

@media (forced-colors: active) {
  #map canvas { background: #16171b; }
  .key span::before, .bars span { forced-color-adjust: none; }
  #places [aria-current], nav [aria-expanded="true"] { border: 3px solid Highlight; }
}
`;
