// The geometry, then all images with at most 256 texels a side, then the full ones; of either kind
// what lies in the view first, and the nearest first.

import { Box3, Frustum, Matrix4, TextureLoader } from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { add, camera, draw, end, files } from "./stage.js";

// Browsers fetch six at a time.
const LANES = 6;
const { scene: model } = await new GLTFLoader().loadAsync(files.model);
add(model);
draw();

const frustum = new Frustum().setFromProjectionMatrix(
  new Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse));
const images = files.small.map(() => ({ materials: [], distance: Infinity, seen: false }));
model.traverse((mesh) => {
  const image = images[mesh.material?.userData.image];
  if (!image) return;
  const box = new Box3().setFromObject(mesh);
  image.materials.push(mesh.material);
  image.distance = Math.min(image.distance, box.distanceToPoint(camera.position));
  image.seen ||= frustum.intersectsBox(box);
});
const order = [...images.keys()].filter((k) => images[k].materials.length);
order.sort((a, b) => images[b].seen - images[a].seen || images[a].distance - images[b].distance);

const loader = new TextureLoader();
async function show(image, url) {
  const texture = await loader.loadAsync(url);
  for (const material of image.materials) {
    const { wrapS, wrapT } = material.userData;
    const wrapped = texture.clone();
    const wrap = (number) => (number === 33071 ? 1001 : 1000);
    Object.assign(wrapped, { wrapS: wrap(wrapS), wrapT: wrap(wrapT), flipY: false });
    material.map?.dispose();
    material.map = wrapped;
    material.needsUpdate = true;
  }
  draw();
}

async function showAll(urls) {
  const waiting = order.slice();
  const lane = async () => {
    for (let k; (k = waiting.shift()) !== undefined; ) await show(images[k], urls[k]);
  };
  await Promise.all(Array.from({ length: LANES }, lane));
}

await showAll(files.small);
await showAll(files.full);
end();
