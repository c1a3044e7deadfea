// One GLB with everything in it, the textures as KTX2.

import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { KTX2Loader } from "three/addons/loaders/KTX2Loader.js";
import { add, end, files, renderer } from "./stage.js";

const transcoder = new KTX2Loader().setTranscoderPath(files.transcoder).detectSupport(renderer);
transcoder.init(); // asks for the transcoder while the model is on its way
const { scene: model } = await new GLTFLoader().setKTX2Loader(transcoder).loadAsync(files.model);
add(model);
end();
