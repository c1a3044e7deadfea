// The drawing context of a page.

/** Smooth edges cost too much without a graphics card. @param {HTMLCanvasElement} canvas */
export function contextOf(canvas) {
  const options = { antialias: true, failIfMajorPerformanceCaveat: true };
  const plain = { antialias: false };
  const gl = canvas.getContext("webgl2", options) ?? canvas.getContext("webgl2", plain);
  return /** @type {WebGL2RenderingContext | null} */ (gl);
}
