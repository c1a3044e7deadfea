// Put before the scripts of a page: keeps what its canvas shows, as long as the page is open.
// `window.recorder.count` pictures, `packed(k)` one of them, `done` when the page was complete.
// Pictures stay in the page until then, so that handing them out takes nothing from the link.

(() => {
  const EVERY = 40; // ms
  const pictures = [];
  const contexts = [];
  let taken = -Infinity;

  const { getContext } = HTMLCanvasElement.prototype;
  HTMLCanvasElement.prototype.getContext = function (kind, options) {
    const kept = kind === "webgl2" ? { ...options, preserveDrawingBuffer: true } : options;
    const context = getContext.call(this, kind, kept);
    if (kind === "webgl2" && context && !contexts.includes(context)) contexts.push(context);
    return context;
  };

  /** The pixels of the canvas, rows from the bottom; leaves all bindings as they were. */
  function read(gl) {
    const { drawingBufferWidth: width, drawingBufferHeight: height } = gl;
    const framebuffer = gl.getParameter(gl.READ_FRAMEBUFFER_BINDING);
    const buffer = gl.getParameter(gl.PIXEL_PACK_BUFFER_BINDING);
    const pixels = new Uint8Array(4 * width * height);
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, null);
    gl.bindBuffer(gl.PIXEL_PACK_BUFFER, null);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, framebuffer);
    gl.bindBuffer(gl.PIXEL_PACK_BUFFER, buffer);
    return { width, height, pixels };
  }

  function equal(a, b) {
    if (a.pixels.length !== b.pixels.length) return false;
    const [one, other] = [a, b].map(({ pixels }) => new Uint32Array(pixels.buffer));
    return one.every((pixel, k) => pixel === other[k]);
  }

  function take() {
    requestAnimationFrame(take);
    const time = performance.now();
    const gl = contexts.findLast((one) => one.canvas.isConnected && !one.isContextLost());
    if (gl && time - taken >= EVERY) {
      taken = time;
      const picture = read(gl);
      const last = pictures.at(-1);
      if (!last || !equal(last, picture)) pictures.push({ time, ...picture });
    }
    if (COMPLETE) recorder.done ??= time;
  }

  const recorder = {
    get count() {
      return pictures.length;
    },
    done: undefined,
    async packed(k) {
      const { pixels, ...rest } = pictures[k];
      const thin = new Blob([pixels]).stream().pipeThrough(new CompressionStream("deflate"));
      const bytes = new Uint8Array(await new Response(thin).arrayBuffer());
      return { ...rest, data: btoa(Array.from(bytes, (b) => String.fromCharCode(b)).join("")) };
    },
  };
  window.recorder = recorder;
  requestAnimationFrame(take);
})();
