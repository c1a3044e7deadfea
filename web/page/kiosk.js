// A walk that nobody holds (`?ui=kiosk`): a minute after the last touch it is at its beginning again, with
// nothing open, for the next visitor. `&rest=20` is another number of seconds.

/** The last one is of the script of gamepads. */
const TOUCHES = ["pointerdown", "pointermove", "wheel", "keydown", "gamepadused"];

/** @param {import("./app.js").App} app @param {URLSearchParams} query */
export function attachKiosk(app, query) {
  const given = Number(query.get("rest")), rest = given > 0 ? given : 60;
  /** @type {ReturnType<typeof setTimeout>} */
  let timer;
  const wait = () => {
    clearTimeout(timer);
    timer = setTimeout(() => {
      document.body.dispatchEvent(new KeyboardEvent("keydown", { code: "Escape", bubbles: true }));
      app.tour?.close();
      app.goTo(0);
    }, 1000 * rest);
  };
  for (const touch of TOUCHES) addEventListener(touch, (event) => (event.isTrusted || touch === "gamepadused") && wait(), { capture: true, passive: true });
  wait();
}
