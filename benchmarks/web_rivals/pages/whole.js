// One GLB with everything in it.

import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { add, end, files } from "./stage.js";

const { scene: model } = await new GLTFLoader().loadAsync(files.model);
add(model);
end();
