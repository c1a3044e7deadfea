// The drawing context of a page.

/**
 * Smooth edges cost too much without a graphics card. Nothing behind the canvas shows through.
 * @param {HTMLCanvasElement} canvas
 * @param {boolean} [low] whether the visitor asks for less quality
 */
export function contextOf(canvas, low) {
  const context = (/** @type {boolean} */ antialias) =>
    canvas.getContext("webgl2", { alpha: false, antialias, failIfMajorPerformanceCaveat: antialias });
  return (low ? null : context(true)) ?? context(false);
}

/** UNMASKED_RENDERER_WEBGL. */
const UNMASKED_RENDERER = 0x9246;

/**
 * Whether a graphics card draws, for a visitor who wants all of its quality.
 * @param {WebGL2RenderingContext} gl
 */
export function isCard(gl) {
  return gl.getContextAttributes()?.antialias && gl.getExtension("WEBGL_debug_renderer_info")
    && !/Swift|llvm|Basic/.test(gl.getParameter(UNMASKED_RENDERER));
}
