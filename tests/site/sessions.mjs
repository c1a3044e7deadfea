// Sessions of WebXR that fail, and one with canted displays: node sessions.mjs PAGE prints one line of JSON.

import { pathToFileURL } from "node:url";

const PAGE = process.argv[2], of = (name) => import(pathToFileURL(`${PAGE}/${name}`));
const { enterVr } = await of("xr.js");
const { axesOf, headingOf } = await of("xr/eyes.js");
const { Solids } = await of("walk/solids.js");
const { Walker } = await of("walk/walker.js");

/** 4 x 4, by columns: yaw, then pitch. */
const matrix = ([x, y, z], yaw, pitch) => {
  const [s, c, t, d] = [Math.sin(yaw), Math.cos(yaw), Math.sin(pitch), Math.cos(pitch)];
  return [c, 0, -s, 0, s * t, d, c * t, 0, s * d, -t, c * d, 0, x, y, z, 1];
};
const PICTURES = 2;
const LENS = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, -1, 0, 0, -0.2, 0];

/** A session with pictures until it ends; `fails` is the step that does. */
class Session extends EventTarget {
  inputSources = [];
  ended = 0;
  constructor(fails, head, cant) {
    super();
    Object.assign(this, { fails, head, cant });
  }
  updateRenderState() {}
  async requestReferenceSpace() {
    if (this.fails === "space") throw new Error("space");
    return {};
  }
  requestAnimationFrame(call) {
    if (this.ended) return;
    const { place = [0, 1.7, 0], yaw = 0, pitch = 0 } = this.head;
    const views = [0, 1].map((k) => ({
      transform: { matrix: matrix(place, yaw + this.cant[k], pitch) }, projectionMatrix: LENS,
    }));
    const pose = { transform: { matrix: matrix(place, yaw, pitch) }, views };
    setTimeout(() => this.ended || call(performance.now(), { getViewerPose: () => pose }));
  }
  async end() {
    if (this.ended++) throw new Error("ended");
    this.dispatchEvent(new Event("end"));
  }
}

class Walk {
  poses = [];
  viewport = { far: 50, tall: 1, aspect: 1, lines: 1 };
  picture = {
    drawn: [],
    renderer: new (class {
      draw() {}
    })(),
    turn() {},
  };
  constructor(gl) {
    this.gl = gl;
  }
  frame(pose) {
    if (this.fails) throw new Error("frame");
    this.poses.push(pose);
  }
}

/** The walk after a session, and what its visitor is told. */
async function visit({ fails = "", head = {}, cant = [0, 0] }) {
  const session = new Session(fails, head, cant), refuse = (name) => {
    if (fails === name) throw new Error(name);
  };
  Object.defineProperty(globalThis, "navigator", { configurable: true, value: {
    xr: { requestSession: async () => (refuse("session"), session) },
  } });
  globalThis.XRWebGLLayer = class {
    constructor() {
      refuse("layer");
    }
    getViewport() {
      return { x: 0, y: 0, width: 100, height: 100 };
    }
  };
  const none = () => {}, gl = { makeXRCompatible: async () => refuse("card"), isContextLost: () => false };
  for (const name of ["bindFramebuffer", "enable", "disable", "viewport", "scissor"]) gl[name] = none;
  const walk = new Walk(gl), { viewport } = walk, own = Object.keys(walk).join();
  walk.fails = fails === "frame";
  const solids = new Solids();
  solids.add(0, [], { portals: [] });
  const walker = new Walker({ solids, locate: () => 0, avatar: [0.25, 1.6, 0.5] });
  walker.place({ eye: [0, 1.6, 0], yaw: 0.4, pitch: 0 });
  const frame = function (time, wishes) {
    walker.step(time, wishes);
    walk.frame(walker.pose);
  };
  const app = { walk, walker, frame, index: { viewpoints: [] } };
  let message = "";
  const over = enterVr(app).catch((fault) => (message = fault.message));
  while (!message && walk.poses.length < PICTURES) await new Promise((go) => setTimeout(go));
  if (!message) await session.end();
  await over;
  await new Promise((go) => setTimeout(go));
  const same = app.frame === frame && walk.viewport === viewport && walk.frame === Walk.prototype.frame
    && Object.keys(walk).filter((name) => name !== "fails").join() === own;
  return { walk, walker, message, same, ended: fails === "session" || session.ended > 0 };
}

const failures = {};
for (const fails of ["session", "card", "layer", "space", "frame"]) {
  const { message, same, ended } = await visit({ fails });
  failures[fails] = { message, same, ended };
}
let off = 0;
for (const [yaw, pitch] of [[0, 0], [1, 0.3], [-2, -0.5], [3, 0.9]]) {
  for (const cant of [[0, 0], [0.1, -0.1], [0.2, 0.2], [0, -0.3]]) {
    const { walk, walker } = await visit({ head: { yaw, pitch }, cant });
    // The session begins where the walker looked.
    const head = headingOf(axesOf(matrix([0, 0, 0], 0.4, pitch)));
    for (const pose of walk.poses) {
      const turn = pose.yaw - head.yaw;
      off = Math.max(off, Math.abs(Math.sin(turn)), 1 - Math.cos(turn), Math.abs(pose.pitch - head.pitch));
    }
    off = Math.max(off, Math.abs(Math.sin(walker.pose.yaw - 0.4)));
  }
}
console.log(JSON.stringify({ failures, off }));
