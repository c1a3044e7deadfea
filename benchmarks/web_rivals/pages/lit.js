// A GLB as pages of three.js usually show it: with its own lights, the studio that three.js ships as an
// environment, and the curve PBR Neutral. The exposure takes the mean of the picture's log luminance to `KEY`,
// as `benchmarks/light_reference.py` does. `window.complete` says that it is drawn.

import {
  FloatType, MathUtils, NeutralToneMapping, PerspectiveCamera, PMREMGenerator, Scene, Vector3, WebGLRenderer,
  WebGLRenderTarget,
} from "three";
import { RoomEnvironment } from "three/addons/environments/RoomEnvironment.js";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";

const KEY = 0.3;

const renderer = new WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
renderer.setSize(innerWidth, innerHeight);
document.body.append(renderer.domElement);
const scene = new Scene();
const room = new RoomEnvironment();
scene.environment = scene.background = new PMREMGenerator(renderer).fromScene(room, 0.04).texture;
const { scene: model } = await new GLTFLoader().loadAsync("model.glb");
scene.add(model);

/** The picture of a view: its eye, a point on the axis and the vertical angle in degrees. */
window.show = (eye, target, angle) => {
  const camera = new PerspectiveCamera(angle, innerWidth / innerHeight, 0.05, 1000);
  camera.position.set(...eye);
  camera.lookAt(new Vector3(...target));
  const linear = new WebGLRenderTarget(innerWidth, innerHeight, { type: FloatType });
  renderer.setRenderTarget(linear);
  renderer.render(scene, camera);
  const light = new Float32Array(4 * innerWidth * innerHeight);
  renderer.readRenderTargetPixels(linear, 0, 0, innerWidth, innerHeight, light);
  renderer.setRenderTarget(null);
  let sum = 0;
  for (let k = 0; k < light.length; k += 4)
    sum += Math.log(1e-4 + 0.2126 * light[k] + 0.7152 * light[k + 1] + 0.0722 * light[k + 2]);
  renderer.toneMapping = NeutralToneMapping;
  renderer.toneMappingExposure = MathUtils.clamp(KEY / Math.exp((4 * sum) / light.length), 1e-6, 1e6);
  renderer.render(scene, camera);
  renderer.toneMapping = 0;
};
window.complete = true;
