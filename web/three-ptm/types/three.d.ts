// What this package uses of three.js, which ships no types of its own. Only for checking.

export class EventDispatcher {
  addEventListener(type: string, listener: (event: { type: string }) => void): void;
}
export class Vector2 {
  constructor(x?: number, y?: number);
}
export class Vector3 {
  constructor(...coordinates: number[]);
  x: number;
  y: number;
  z: number;
  add(other: Vector3): this;
  addScaledVector(other: Vector3, scale: number): this;
  applyAxisAngle(axis: Vector3, angle: number): this;
  clone(): Vector3;
  cross(other: Vector3): this;
  distanceTo(other: Vector3): number;
  normalize(): this;
  set(...coordinates: number[]): this;
  toArray(): number[];
}
export class Box2 {
  constructor(min: Vector2, max: Vector2);
}
export class Plane {
  setFromNormalAndCoplanarPoint(normal: Vector3, point: Vector3): this;
  distanceToPoint(point: Vector3): number;
}
export class Source {
  dataReady: boolean;
}
interface Mip {
  data: ArrayBufferView | null;
  width: number;
  height: number;
}
export class Texture extends EventDispatcher {
  source: Source;
  mipmaps: Mip[];
  wrapS: number;
  wrapT: number;
  magFilter: number;
  minFilter: number;
  anisotropy: number;
  colorSpace: string;
  channel: number;
  set needsUpdate(value: boolean);
  clone(): this;
  dispose(): void;
}
export class DataTexture extends Texture {
  constructor(data: ArrayBufferView | null, width: number, height: number);
}
export class Color {
  constructor(r: number, g: number, b: number);
  r: number;
  convertSRGBToLinear(): this;
}
export class Material {
  color: Color;
  opacity: number;
  transparent: boolean;
  alphaTest: number;
  vertexColors: boolean;
  side: number;
  toneMapped: boolean;
  premultipliedAlpha: boolean;
  metalness: number;
  roughness: number;
  userData: {
    texture?: number;
    wrapS?: number;
    wrapT?: number;
    mesh?: number;
    light?: number;
    white?: number;
    probe?: number;
    normal?: number;
    normalCoords?: number;
    normalScale?: number;
    normalWrapS?: number;
    normalWrapT?: number;
  };
  dispose(): void;
}
export class MeshBasicMaterial extends Material {
  constructor(look: {
    color?: Color;
    opacity?: number;
    transparent?: boolean;
    alphaTest?: number;
    vertexColors?: boolean;
    side?: number;
    depthWrite?: boolean;
    map?: Texture | null;
    lightMap?: Texture | null;
  });
  customProgramCacheKey: () => string;
  onBeforeCompile: (shader: {
    uniforms: Record<string, { value: unknown }>;
    vertexShader: string;
    fragmentShader: string;
  }) => void;
}
export class Object3D {
  children: Object3D[];
  position: Vector3;
  rotation: { order: string; x: number; y: number };
  add(...children: Object3D[]): this;
  lookAt(point: Vector3): void;
  getWorldDirection(out: Vector3): Vector3;
  removeFromParent(): this;
  traverse(visit: (node: Object3D) => void): void;
}
export class Group extends Object3D {}
export class Scene extends Object3D {}
export class BufferAttribute {
  constructor(numbers: Float32Array | Uint16Array, size: number, normalized?: boolean);
  array: Float32Array | Uint16Array | Uint8Array;
}
export class BufferGeometry {
  attributes: Partial<Record<string, BufferAttribute>>;
  setAttribute(name: string, attribute: BufferAttribute): this;
  deleteAttribute(name: string): this;
  dispose(): void;
}
export class ShaderMaterial extends Material {
  constructor(look: {
    uniforms: Record<string, { value: unknown }>;
    vertexShader: string;
    fragmentShader: string;
    depthWrite?: boolean;
    toneMapped?: boolean;
  });
}
export class Mesh extends Object3D {
  constructor(geometry: BufferGeometry, material: Material);
  geometry: BufferGeometry;
  material: Material;
}
export class PerspectiveCamera extends Object3D {
  constructor(fov: number, aspect: number, near: number, far: number);
  aspect: number;
  updateProjectionMatrix(): void;
}
export class WebGLRenderer {
  constructor(options?: { antialias?: boolean; canvas?: HTMLCanvasElement });
  domElement: HTMLCanvasElement;
  capabilities: { maxTextureSize: number };
  getContext(): WebGL2RenderingContext;
  initTexture(texture: Texture): void;
  copyTextureToTexture(
    source: Texture,
    target: Texture,
    region?: Box2 | null,
    position?: Vector2 | null,
    sourceLevel?: number,
    targetLevel?: number,
  ): void;
  render(scene: Object3D, camera: PerspectiveCamera): void;
  setAnimationLoop(step: (time: number) => void): void;
  setPixelRatio(ratio: number): void;
  setSize(width: number, height: number): void;
}
export const ClampToEdgeWrapping: number;
export const RepeatWrapping: number;
export const LinearFilter: number;
export const LinearMipmapLinearFilter: number;
export const NoColorSpace: string;
export const SRGBColorSpace: string;
export const MathUtils: { radToDeg(angle: number): number };
