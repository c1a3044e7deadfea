// The drawing context of a page.

/**
 * Smooth edges cost too much without a graphics card.
 * @param {HTMLCanvasElement} canvas
 * @param {boolean} [low] whether the visitor asks for less quality
 */
export function contextOf(canvas, low) {
  const options = { antialias: true, failIfMajorPerformanceCaveat: true };
  const plain = { antialias: false };
  const gl = (low ? null : canvas.getContext("webgl2", options)) ?? canvas.getContext("webgl2", plain);
  return /** @type {WebGL2RenderingContext | null} */ (gl);
}

/**
 * Whether a graphics card draws, for a visitor who wants all of its quality.
 * @param {WebGL2RenderingContext} gl
 */
export function isCard(gl) {
  const names = gl.getExtension("WEBGL_debug_renderer_info");
  const name = gl.getParameter(names ? names.UNMASKED_RENDERER_WEBGL : gl.RENDERER);
  return gl.getContextAttributes()?.antialias && !/swiftshader|llvmpipe|basic render/i.test(name);
}
