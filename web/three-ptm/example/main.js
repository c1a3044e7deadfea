// Walks through a database: arrow keys or W A S D, and dragging to look around. No collision.
// ?index=URL of hints.json, &budget=MiB of texture memory.

import { MathUtils, PerspectiveCamera, Scene, Vector3, WebGLRenderer } from "three";
import { Walk } from "three-ptm";

/** Metres a second. */
const SPEED = 1.5;
/** Radians for a pixel that the pointer is dragged. */
const TURN = 0.004;
const UP = new Vector3(0, 1, 0);

/** Metres ahead and to the right. @type {Record<string, [number, number]>} */
const STEPS = {
  ArrowUp: [1, 0], KeyW: [1, 0],
  ArrowDown: [-1, 0], KeyS: [-1, 0],
  ArrowLeft: [0, -1], KeyA: [0, -1],
  ArrowRight: [0, 1], KeyD: [0, 1],
};

/**
 * @param {string} index
 * @param {number} mebibytes
 */
async function show(index, mebibytes) {
  const status = /** @type {HTMLElement} */ (document.getElementById("status"));
  const renderer = new WebGLRenderer({ antialias: true });
  const canvas = document.body.appendChild(renderer.domElement);
  const walk = await Walk.open(renderer, index, { budget: mebibytes * 2 ** 20 });
  const [view] = walk.index.viewpoints;
  const camera = new PerspectiveCamera(MathUtils.radToDeg(view.fieldOfView), 1, 0.05, 1000);
  camera.rotation.order = "YXZ";
  camera.position.set(...view.position);
  camera.lookAt(camera.position.clone().add(new Vector3(...view.direction)));
  const scene = new Scene().add(walk.shown);
  if (walk.surroundings) scene.add(walk.surroundings);

  const fit = () => {
    renderer.setPixelRatio(devicePixelRatio);
    renderer.setSize(innerWidth, innerHeight);
    camera.aspect = innerWidth / innerHeight;
    camera.updateProjectionMatrix();
  };
  fit();
  addEventListener("resize", fit);

  const held = new Set();
  addEventListener("keydown", ({ code }) => held.add(code));
  addEventListener("keyup", ({ code }) => held.delete(code));
  addEventListener("blur", () => held.clear());
  canvas.addEventListener("pointerdown", ({ pointerId }) => canvas.setPointerCapture(pointerId));
  canvas.addEventListener("pointermove", ({ buttons, movementX, movementY }) => {
    if (!buttons) return;
    camera.rotation.y += movementX * TURN;
    camera.rotation.x = Math.min(Math.max(camera.rotation.x + movementY * TURN, -1.5), 1.5);
  });

  let last = performance.now();
  renderer.setAnimationLoop((now) => {
    const way = (SPEED * Math.min(now - last, 100)) / 1000;
    last = now;
    const ahead = new Vector3(0, 0, -1).applyAxisAngle(UP, camera.rotation.y);
    const right = new Vector3(1, 0, 0).applyAxisAngle(UP, camera.rotation.y);
    for (const code of held) {
      const [forward, sideways] = STEPS[code] ?? [0, 0];
      camera.position.addScaledVector(ahead, way * forward).addScaledVector(right, way * sideways);
    }
    walk.update(camera.position);
    renderer.render(scene, camera);
    const used = (walk.gpuBytes / 2 ** 20).toFixed(1);
    const cells = `cell ${walk.cell}, ${walk.shown.children.length} cells in sight`;
    status.textContent = `${cells}, textures: ${used} of ${mebibytes} MiB`;
  });
}

const query = new URLSearchParams(location.search);
const index = query.get("index");
if (index) await show(index, Number(query.get("budget") ?? 256));
