import { Group, Texture } from "three";

export class GLTFLoader {
  setMeshoptDecoder(decoder: object): this;
  register(plugin: () => { name: string; loadTexture: () => Promise<Texture> }): this;
  parseAsync(data: ArrayBuffer, path: string): Promise<{ scene: Group }>;
}
