// A GLB with small images, whose levels gltf-progressive asks for as the view needs them.

import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { NEEDLE_progressive, useNeedleProgressive } from "@needle-tools/gltf-progressive";
import { add, camera, end, files, renderer, scene } from "./stage.js";

// Frames in which no level is on its way, before nothing more is expected.
const QUIET = 30;
let pending = 0;
const { getOrLoadLOD } = NEEDLE_progressive;
NEEDLE_progressive.getOrLoadLOD = async function (...given) {
  pending++;
  try {
    return await getOrLoadLOD.apply(this, given);
  } finally {
    pending--;
  }
};

const loader = new GLTFLoader();
useNeedleProgressive(loader, renderer);
const { scene: model } = await loader.loadAsync(files.model);
add(model);
let quiet = 0;
renderer.setAnimationLoop(() => {
  renderer.render(scene, camera);
  quiet = pending ? 0 : quiet + 1;
  if (quiet < QUIET) return;
  renderer.setAnimationLoop(null);
  end();
});
