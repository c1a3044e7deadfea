// Put before the scripts of a page: `play` moves its visitor along a way, and records each frame.

(() => {
  /** Bytes of texels that were uploaded, and ms that the calls took. */
  const uploaded = { bytes: 0, ms: 0 };
  const prototype = WebGL2RenderingContext.prototype;
  const sizeOf = (source) => source?.byteLength ?? 4 * (source?.width ?? 0) * (source?.height ?? 0);
  for (const name of ["texImage2D", "texSubImage2D", "texImage3D", "texSubImage3D"]) {
    const call = prototype[name];
    prototype[name] = function (...given) {
      const begin = performance.now(), source = given.find((one) => one && typeof one === "object");
      const result = call.apply(this, given);
      uploaded.ms += performance.now() - begin;
      uploaded.bytes += sizeOf(source);
      return result;
    };
  }

  /** The values between two rows of the way: s, then numbers without jumps. */
  function at(way, time) {
    let k = 1;
    while (k < way.length - 1 && way[k][0] < time) k++;
    const [from, to] = [way[k - 1], way[k]], share = (time - from[0]) / (to[0] - from[0]);
    return from.slice(1).map((x, i) => x + Math.min(1, Math.max(0, share)) * (to[i + 1] - x));
  }

  /** Rows of frames: s since the beginning, and bytes and ms of uploads until then. */
  window.play = (way, place) => new Promise((done) => {
    const frames = [], begin = performance.now(), before = { ...uploaded };
    const step = () => {
      const now = (performance.now() - begin) / 1000;
      frames.push([now, uploaded.bytes - before.bytes, uploaded.ms - before.ms]);
      if (now >= way[way.length - 1][0]) return done(frames);
      place(...at(way, now));
      requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  });

  /** What draws. */
  window.rendererName = () => {
    const gl = document.createElement("canvas").getContext("webgl2");
    const info = gl?.getExtension("WEBGL_debug_renderer_info");
    const name = gl?.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : gl.RENDERER);
    gl?.getExtension("WEBGL_lose_context")?.loseContext();
    return String(name);
  };
})();
