// The script of headsets: a session of WebXR, in which the walk is drawn once for each eye
// (docs/formats/devices.md).

import { Body } from "./xr/body.js";
import { cameraOfEye, headingOf, unionOf } from "./xr/eyes.js";

/** Metres to the near plane, as that of the page. */
const NEAR = 0.1;

/**
 * Draws the walk for the eyes in place of the page's view.
 * @param {import("./walkthrough.js").Walkthrough} walk
 * @param {() => {axes: number[][], eyes: import("./xr/eyes.js").Eye[],
 *   viewports: {x: number, y: number, width: number, height: number}[]}} look the axes are of the head
 * @param {any} layer of WebXR
 * @returns {() => void} ends it
 */
function drawingBoth(walk, look, layer) {
  const { frame, viewport } = walk, { tall, aspect, lines } = viewport;
  const { samples } = walk.picture.renderer;
  let view = { tall, aspect, lines };
  walk.viewport = Object.create(viewport, {
    full: { value: true }, settle: { value: () => false },
    tall: { get: () => view.tall }, aspect: { get: () => view.aspect }, lines: { get: () => view.lines },
  });
  walk.frame = () => {
    const { axes, eyes, viewports } = look(), { gl, picture, picture: { renderer } } = walk;
    const middle = [0, 1, 2].map((k) => eyes.reduce((sum, { place }) => sum + place[k], 0) / eyes.length);
    const union = unionOf(eyes, { eye: middle, ...headingOf(axes) });
    view = union;
    // The view of the page is chosen from, not drawn.
    renderer.draw = () => false;
    try {
      frame.call(walk, union.pose);
    } finally {
      Reflect.deleteProperty(renderer, "draw");
    }
    if (gl.isContextLost()) return;
    if (!layer.antialias) renderer.samples = 1;
    gl.bindFramebuffer(gl.FRAMEBUFFER, layer.framebuffer);
    gl.enable(gl.SCISSOR_TEST);
    eyes.forEach((eye, k) => {
      const { x, y, width, height } = viewports[k];
      gl.viewport(x, y, width, height);
      gl.scissor(x, y, width, height);
      renderer.draw(cameraOfEye(eye), picture.drawn, performance.now() / 1000);
    });
    gl.disable(gl.SCISSOR_TEST);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  };
  return () => {
    walk.picture.renderer.samples = samples;
    Reflect.deleteProperty(walk, "frame");
    walk.viewport = viewport;
    walk.picture.turn();
  };
}

/**
 * Enters the building with a headset; resolved at the end of the session. Rejects if there can be none, or if a
 * picture of it fails.
 * @param {import("./app.js").App} app
 */
export async function enterVr(app) {
  const { walk, walker } = app, { gl } = walk, { xr } = /** @type {any} */ (navigator);
  const session = await xr.requestSession("immersive-vr", { optionalFeatures: ["local-floor"] });
  /** @type {(fault: unknown) => void} */
  let fail = () => {};
  const over = new Promise((resolve, reject) => {
    session.addEventListener("end", resolve);
    fail = reject;
  });
  // It may have ended by itself.
  const end = () => session.end().catch(() => {});
  /** @type {any} */
  let space;
  let floored = true, leave = () => {};
  try {
    await (/** @type {any} */ (gl)).makeXRCompatible();
    const layer = new (/** @type {any} */ (globalThis)).XRWebGLLayer(session, gl);
    session.updateRenderState({ baseLayer: layer, depthNear: NEAR, depthFar: walk.viewport.far });
    space = await session.requestReferenceSpace("local-floor").catch(() => null);
    floored = Boolean(space);
    space ??= await session.requestReferenceSpace("local");
    const body = new Body(walker, floored), { frame } = app;
    /** @type {any[]} */
    let views = [], place = 0, before = 0;
    const look = () => {
      const viewports = views.map((view) => layer.getViewport(view));
      return { axes: body.axes, eyes: views.map((view, k) => body.eye(view, viewports[k].height)), viewports };
    };
    const stop = drawingBoth(walk, look, layer);
    // The page has no frames of its own meanwhile. A gamepad that is connected now keeps this one.
    let left = false;
    const still = (/** @type {Parameters<typeof frame>} */ ...words) => {
      if (left) frame.apply(app, words);
    };
    app.frame = still;
    leave = () => {
      left = true;
      if (app.frame === still) app.frame = frame;
      stop();
    };
    session.addEventListener("selectstart", () => (body.pressed = true));
    session.addEventListener("selectend", () => (body.pressed = false));
    session.addEventListener("squeeze", () => {
      place = (place + 1) % app.index.viewpoints.length;
      app.goTo(place);
      body.face();
    });
    const draw = (/** @type {number} */ now, /** @type {any} */ seen) => {
      const viewer = seen.getViewerPose(space), time = before ? (now - before) / 1000 : 0;
      before = now;
      if (!viewer?.views.length) return;
      ({ views } = viewer);
      frame.call(app, time, body.follow(viewer.transform.matrix, session.inputSources));
    };
    const paint = (/** @type {number} */ now, /** @type {any} */ seen) => {
      try {
        draw(now, seen);
        session.requestAnimationFrame(paint);
      } catch (fault) {
        fail(fault);
      }
    };
    session.requestAnimationFrame(paint);
    await over;
  } catch (fault) {
    end();
    throw fault;
  } finally {
    leave();
  }
}
