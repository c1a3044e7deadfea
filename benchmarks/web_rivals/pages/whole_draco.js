// One GLB with everything in it, compressed with Draco; the decoder is asked for at once.

import { DRACOLoader } from "three/addons/loaders/DRACOLoader.js";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { add, end, files } from "./stage.js";

const draco = new DRACOLoader().setDecoderPath(files.decoder);
draco.preload();
const { scene: model } = await new GLTFLoader().setDRACOLoader(draco).loadAsync(files.model);
add(model);
end();
