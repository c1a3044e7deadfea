// What the rivals' pages have in common: a canvas as large as the window, a camera at the first
// viewpoint, and `window.rival.complete`, which says that nothing more will come. Colours go to the
// screen as textures hold them, and levels are averages of what they hold, as in the walk page. The
// origin of the walk page's world is subtracted from a model that keeps its own.

import {
  LinearSRGBColorSpace, MathUtils, NoColorSpace, PerspectiveCamera, Scene, Vector3, WebGLRenderer,
} from "three";

export const { view, files } = JSON.parse(document.getElementById("settings").textContent);
export const scene = new Scene();
export const camera = new PerspectiveCamera(
  MathUtils.radToDeg(view.fieldOfView), innerWidth / innerHeight, 0.05, 1000);
export const renderer = new WebGLRenderer({ antialias: true });

camera.position.set(...view.position);
camera.lookAt(new Vector3(...view.direction).add(camera.position));
camera.updateMatrixWorld();
renderer.setSize(innerWidth, innerHeight);
renderer.outputColorSpace = LinearSRGBColorSpace;
document.body.append(renderer.domElement);
window.rival = { complete: false };

/** Adds a model; the colours of its materials become what is on the screen. */
export function add(model) {
  model.traverse(({ material }) => {
    if (!material) return;
    material.color.convertLinearToSRGB();
    if (material.map) material.map.colorSpace = NoColorSpace;
  });
  if (files.origin) model.position.sub(new Vector3(...files.origin));
  scene.add(model);
}

/** Draws when the next frame is due. */
export function draw() {
  requestAnimationFrame(() => renderer.render(scene, camera));
}

/** Draws for the last time; complete once that is on the screen. */
export function end() {
  requestAnimationFrame(() => {
    renderer.render(scene, camera);
    window.rival.complete = true;
  });
}
