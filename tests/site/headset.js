// A headset for tests, in place of the browser's: two eyes `ptmHeadset.apart` metres apart, whose pictures are the
// halves of the canvas. `ptmHeadset` has the head (metres above the floor, radians), the controllers, and why no
// session begins.

(() => {
  const rig = { head: [0, 1.7, 0], yaw: 0, apart: 0.2, sources: [], session: null, frames: 0, slopes: [1, 1], fails: "" };
  window.ptmHeadset = rig;
  /** 4 x 4, by columns, of a place beside the head. */
  const matrix = (aside) => {
    const s = Math.sin(rig.yaw), c = Math.cos(rig.yaw), [x, y, z] = rig.head;
    return [c, 0, -s, 0, 0, 1, 0, 0, s, 0, c, 0, x + aside * c, y, z - aside * s, 1];
  };
  /** Of the outer and the inner slope. */
  const projection = (side) => {
    const [outer, inner] = rig.slopes, near = 0.1, far = rig.session.depthFar;
    const [left, right] = side < 0 ? [outer, inner] : [inner, outer];
    const [x, y] = [2 / (left + right), 1];
    return [x, 0, 0, 0, 0, y, 0, 0, (right - left) / (left + right), 0, -(far + near) / (far - near), -1,
      0, 0, (-2 * far * near) / (far - near), 0];
  };
  class Session extends EventTarget {
    inputSources = rig.sources;
    updateRenderState({ depthFar }) {
      this.depthFar = depthFar;
    }
    async requestReferenceSpace(type) {
      return { type };
    }
    requestAnimationFrame(call) {
      requestAnimationFrame((now) => {
        if (rig.session !== this) return;
        rig.frames++;
        const views = [-1, 1].map((side) => ({
          side, transform: { matrix: matrix((side * rig.apart) / 2) }, projectionMatrix: projection(side),
        }));
        call(now, { getViewerPose: () => ({ transform: { matrix: matrix(0) }, views }) });
      });
    }
    async end() {
      rig.session = null;
      this.dispatchEvent(new Event("end"));
    }
  }
  Object.defineProperty(navigator, "xr", { value: {
    isSessionSupported: async (mode) => mode === "immersive-vr",
    requestSession: async () => {
      if (rig.fails) throw new Error(rig.fails);
      return (rig.session = new Session());
    },
  } });
  window.XRWebGLLayer = class {
    framebuffer = null;
    constructor(session, gl) {
      this.gl = gl;
    }
    getViewport({ side }) {
      const { width, height } = this.gl.canvas, half = width >> 1;
      return { x: side < 0 ? 0 : half, y: 0, width: half, height };
    }
  };
  WebGL2RenderingContext.prototype.makeXRCompatible = async () => {};
})();
