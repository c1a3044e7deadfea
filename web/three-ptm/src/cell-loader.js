// Cells from their GLBs, as docs/formats/gltf.md describes them: with the textures and the light of this
// adapter, or unlit. Only what has a normal map is lit by a lamp.

import { BufferAttribute, ClampToEdgeWrapping, Color, Mesh, MeshBasicMaterial, RepeatWrapping, Texture } from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";

import { loadViewDecoder } from "ptm-decoder";
import { cut } from "./cutout.js";
import { glaze, illuminate } from "./light.js";
import { bump, relieve } from "./relief.js";

/** @typedef {import("three").Group} Group */
/**
 * Returns the texture with a number in the index, with these wrap modes; of a material's normal map, `beside` is
 * the texture that the material shows, or -1.
 * @typedef {(texture: number, wrapS: number, wrapT: number, beside?: number) => Texture} TextureOf
 */

/** @typedef {import("./light.js").Light} Light */
/** @typedef {import("./light.js").Exposure} Exposure */
/** @typedef {import("./light.js").Mirrored} Mirrored */

const CLAMP = 33071;
/** The light of buildings, as builds write it. @type {Light} */
const LIGHT = { stops: 10, tone: "neutral" };

/** @type {Promise<import("ptm-decoder").ViewDecoder> | undefined} */
let decoder;

/** The decoder of compressed cells, in the form that GLTFLoader takes. */
const meshoptDecoder = {
  supported: true,
  /**
   * @param {number} count
   * @param {number} stride
   * @param {Uint8Array} source
   * @param {string} mode
   * @param {string} [filter]
   */
  async decodeGltfBufferAsync(count, stride, source, mode, filter) {
    const views = await (decoder ??= loadViewDecoder());
    if (mode === "ATTRIBUTES") return views.attributes(source, count, stride, filter === "EXPONENTIAL");
    const indices = views.triangles(source, count, 2 ** 32 - 1);
    return stride === 2 ? Uint16Array.from(indices) : indices;
  },
};

/** Linear light of sRGB codes, of 65535. */
const LINEAR = Array.from({ length: 256 }, (_, code) =>
  Math.round(65535 * new Color(code / 255, 0, 0).convertSRGBToLinear().r));

/**
 * What GLTFLoader makes of `COLOR_0`, from the codes that published sites have in its place.
 * @param {BufferAttribute} codes red − green, green, blue − green, modulo 256, and 0
 */
function colorsOf({ array }) {
  const colors = new Uint16Array(array).map((code, k) =>
    k % 4 > 2 ? 65535 : LINEAR[k % 4 === 1 ? code : (code + array[k - k % 4 + 1]) & 255]);
  return new BufferAttribute(colors, 4, true);
}

/** Loads no images: the plug-ins with these names take the place of its own. */
function loaderOfGeometry() {
  const loader = new GLTFLoader().setMeshoptDecoder(meshoptDecoder), loadTexture = async () => new Texture();
  for (const name of ["EXT_texture_webp", "EXT_texture_avif"]) loader.register(() => ({ name, loadTexture }));
  return loader;
}

/** Loads cells whose surfaces show the textures of `textureOf`. */
export class CellLoader {
  #textureOf;
  #probeOf;
  #light;
  #exposure;
  #loader = loaderOfGeometry();

  /**
   * @param {TextureOf} textureOf
   * @param {Light} [light] of the index
   * @param {Exposure} [exposure] that lit surfaces share
   * @param {(texture: number) => Omit<Mirrored, "metallic" | "roughness"> | null} [probeOf] returns the probe with a
   *   number in the index; without it nothing reflects
   */
  constructor(textureOf, light = LIGHT, exposure = { value: [1, 1, 1] }, probeOf = () => null) {
    this.#textureOf = textureOf;
    this.#probeOf = probeOf;
    this.#light = light;
    this.#exposure = exposure;
  }

  /**
   * The geometry of a cell, in world coordinates. Rejects with the signal's reason, or with an
   * Error that names the file.
   * @param {string | URL} url
   * @param {AbortSignal} [signal]
   * @returns {Promise<Group>}
   */
  async load(url, signal) {
    const response = await fetch(url, { signal });
    if (!response.ok) throw new Error(`${url}: ${response.status} ${response.statusText}`);
    const { scene } = await this.#loader.parseAsync(await response.arrayBuffer(), "");
    signal?.throwIfAborted();
    // Of plain and of painted meshes, whose materials GLTFLoader tells apart only by `COLOR_0`.
    /** @type {Map<unknown, MeshBasicMaterial>[]} */
    const looks = [new Map(), new Map()];
    // Meshes share them.
    /** @type {Map<BufferAttribute, BufferAttribute>} */
    const decoded = new Map();
    scene.traverse((node) => {
      if (!(node instanceof Mesh)) return;
      const { geometry, material } = node, { attributes } = geometry, codes = attributes._color;
      if (codes) {
        const colors = decoded.get(codes) ?? colorsOf(codes);
        decoded.set(codes, colors);
        geometry.setAttribute("color", colors).deleteAttribute("_color");
      }
      const painted = attributes.color !== undefined, known = looks[+painted];
      const look = known.get(material) ?? this.#look(material, painted);
      known.set(material, look);
      node.material = look;
    });
    return scene;
  }

  /**
   * @param {import("three").Material} material the loader's, with the extras as `userData`
   * @param {boolean} vertexColors
   */
  #look({ color, opacity, transparent, alphaTest, side, metalness, roughness, userData }, vertexColors) {
    const { texture, wrapS, wrapT, mesh, light, white, normal, probe } = userData;
    const wrap = (/** @type {number | undefined} */ n) => (n === CLAMP ? ClampToEdgeWrapping : RepeatWrapping);
    const map = texture === undefined ? null : this.#textureOf(texture, wrap(wrapS), wrap(wrapT));
    const lightMap = light === undefined ? null : this.#textureOf(light, ClampToEdgeWrapping, ClampToEdgeWrapping);
    const depthWrite = !transparent;
    const drawn = { opacity, transparent, alphaTest, vertexColors, side, depthWrite };
    const look = Object.assign(new MeshBasicMaterial({ color, map, lightMap, ...drawn }), { userData: { mesh } });
    const { normalCoords, normalScale = 1, normalWrapS, normalWrapT } = userData;
    if (normal !== undefined && normalCoords !== undefined) {
      const relief = this.#textureOf(normal, wrap(normalWrapS), wrap(normalWrapT), texture ?? -1);
      bump(look, relief, normalScale, normalCoords);
    } else if (normal !== undefined) {
      relieve(look, this.#textureOf(normal, ClampToEdgeWrapping, ClampToEdgeWrapping));
    }
    const seen = probe === undefined || this.#light.tone === "plain" ? null : this.#probeOf(probe);
    const mirrored = seen && { ...seen, metallic: metalness, roughness };
    if (white) illuminate(look, white, this.#light, this.#exposure, mirrored);
    else if (mirrored && transparent && !map) glaze(look, this.#light, this.#exposure, mirrored);
    if (alphaTest && map) cut(look, map);
    return look;
  }
}

/**
 * Removes the coarsest mesh of an object from its cell.
 * @param {Group} cell
 * @param {number} mesh place of the object in the index
 */
export function disposeMesh(cell, mesh) {
  /** @type {Mesh[]} */
  const coarse = [];
  cell.traverse((node) => {
    if (node instanceof Mesh && node.material.userData.mesh === mesh) coarse.push(node);
  });
  for (const node of coarse) {
    node.removeFromParent();
    node.geometry.dispose();
    node.material.dispose();
  }
}

/**
 * Frees the GPU memory of a cell. Its textures stay, since other cells may use them.
 * @param {Group} cell
 */
export function disposeCell(cell) {
  cell.removeFromParent();
  cell.traverse((node) => {
    if (!(node instanceof Mesh)) return;
    node.geometry.dispose();
    node.material.dispose();
  });
}
