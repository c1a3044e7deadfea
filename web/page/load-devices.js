// Scripts for gamepads and headsets, which the build leaves beside those of `load-later.js`.

export const loadGamepad = () => import("./gamepad.js");
export const loadXr = () => import("./xr.js");
