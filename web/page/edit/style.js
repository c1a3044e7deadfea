// The style of the editor.

export const STYLE = `
#panels #edit { width: 400px; padding: 0; display: flex; flex-direction: column; overflow: hidden; }
#edit header, #edit footer { padding: 12px 16px; border: 0 solid var(--line); border-bottom-width: 1px; }
#edit footer { border-width: 1px 0 0; }
#edit header small { display: block; color: var(--dim); overflow-wrap: anywhere; }
#edit h2 { margin: 0; }
#edit .body { overflow: auto; flex: 1; padding: 4px 16px 16px; scrollbar-width: thin; overscroll-behavior: contain; }
#edit .dim, #edit .field small { color: var(--dim); font-size: 13px; }
#edit .field { margin: 10px 0 0; }
#edit .head { display: flex; justify-content: space-between; align-items: baseline; gap: 8px; }
#edit .all { color: var(--dim); font-size: 13px; display: flex; gap: 6px; align-items: center; min-height: 24px; }
#edit input:not([type=checkbox]), #edit textarea, #edit select { font: inherit; color: inherit; background: #0006; border: 1px solid var(--line); border-radius: 8px; padding: 8px 10px; width: 100%; min-height: 40px; margin: 2px 0; }
#edit textarea { resize: vertical; }
#edit ::placeholder { color: var(--dim); opacity: .7; font-style: italic; }
#edit [aria-invalid] { border-color: #ff9d8a !important; }
#edit .row { flex-wrap: wrap; }
#edit ol, #edit ul { list-style: none; margin: 0; padding: 0; display: grid; gap: 6px; }
#edit li { display: flex; gap: 6px; }
#edit li .name { flex: 1; text-align: start; overflow: hidden; text-overflow: ellipsis; }
#edit button:disabled { opacity: .45; cursor: default; }
#edit .main { background: var(--warm); border-color: var(--warm); color: #16171b; }
#edit .back { margin-top: 8px; }
#edit .delete { color: #ff9d8a; }
#edit [role=tablist] { display: flex; flex-wrap: wrap; gap: 4px; }
#edit [role=tab] { min-height: 36px; padding: 0 10px; }
#edit [aria-selected=true] { border-color: var(--warm); color: var(--warm); }
#edit summary { cursor: pointer; min-height: 32px; margin-top: 14px; color: var(--dim); }
#edit .said { min-height: 1.4em; margin: 0; }
#edit .said.wrong { color: #ffb4a5; }
#edit .conflict { border-top: 1px solid var(--line); padding: 10px 16px; background: #5b2a1e; }
#edit .conflict p { margin: 0 0 8px; }
#aim { position: fixed; inset: 0; display: grid; place-items: center; pointer-events: none; }
#aim::before { content: ""; width: 28px; height: 28px; border: 2px solid var(--warm); border-radius: 50%; box-shadow: 0 0 0 2px #000a; }
#aim p { position: absolute; top: 12px; margin: 0; padding: 10px 16px; border-radius: 10px; background: var(--warm); color: #16171b; max-width: min(560px, 60vw); }
.aiming #view { cursor: crosshair; }
@media (max-width: 640px) { #panels #edit { width: 100%; } .aiming #panels #edit, #edit ~ #label { display: none; } #aim p { max-width: 92vw; } }
`;
