// The index of a campus, checked, with the files of each object (docs/formats/campus.md).

import { demand, isWhole } from "../octree/octree.js";

const NAME = /^[A-Za-z0-9_-]{1,80}$/, MESH = /^meshes\/[A-Za-z0-9_-]{1,80}\.glb$/;
/** Channels that the page draws; masks of reflections it does not. */
const CHANNELS = ["d", "a"];
/** Side of the least textures. */
export const LEAST = 128;
const RECORD = /^records\/[A-Za-z0-9_-]{1,80}\.txt$/;
const WIDEST = 65536, MOST = 2 ** 32 - 1;
/** Bytes of the longest record. */
const LONGEST = 2 ** 20;

/**
 * @typedef {object} Material
 * @property {string | null} base of its textures
 * @property {string[]} channels
 * @property {("repeat" | "clamp")[]} wrap across and up
 * @property {number[]} color sRGB
 * @property {number} opacity
 * @property {"opaque" | "mask" | "blend"} alpha
 * @property {number | null} cutoff
 * @property {boolean} twoSided
 *
 * @typedef {object} CampusObject
 * @property {string} name
 * @property {string} label
 * @property {string} [icon]
 * @property {number} [rank]
 * @property {string[]} parts
 * @property {number[]} box
 * @property {number[]} barycentre
 * @property {{position: number[], direction: number[]}} viewpoint
 * @property {number[]} materials
 * @property {string | null} lightmap
 * @property {{file: string, bytes: number, crc32: number}[]} meshes
 * @property {{file: string, bytes: number, crc32: number}} [record]
 *
 * @typedef {{name: string, diffuse: number, light: number}} Preset
 * @typedef {{file: string, bytes: number, crc32: number, base?: string, size?: number, channel?: string}} CampusFile
 */

/** @param {unknown} value @param {number} length @returns {value is number[]} */
const isVector = (value, length) =>
  Array.isArray(value) && value.length === length && value.every((x) => Number.isFinite(x) && Math.abs(x) <= 1e9);

export class CampusIndex {
  /** @type {Map<string, string[]>} */
  #lists = new Map();

  /** @param {any} document `campus.json`; throws an Error if it is damaged */
  constructor(document) {
    demand(document?.format === "ptmtools campus" && document.schema === 1, "not an index of a campus");
    /** @type {CampusObject[]} */
    this.objects = document.objects;
    /** @type {Material[]} */
    this.materials = document.materials;
    /** @type {Preset[]} */
    this.presets = document.presets;
    /** Bytes that every visitor loads first. @type {number} */
    this.start = document.start;
    /** By name. @type {Map<string, CampusFile>} */
    this.files = new Map();
    for (const list of [this.objects, this.materials, this.presets, document.textures]) {
      demand(Array.isArray(list), "a list that is missing");
    }
    for (const row of document.textures) {
      demand(NAME.test(row.base) && ["d", "a", "m", "l"].includes(row.channel), "an impossible texture");
      demand(isWhole(row.size, 1, WIDEST) && row.file === textureFile(row.base, row.size, row.channel), "a texture of another name");
      this.#add(row);
    }
    this.materials.forEach((one) => this.#checkMaterial(one));
    this.objects.forEach((one) => this.#checkObject(one));
    demand(this.objects.length > 0 && this.presets.length > 0, "no objects");
    for (const { diffuse, light } of this.presets) {
      demand(isWhole(diffuse, 1, WIDEST) && isWhole(light, 1, WIDEST), "a preset without sizes");
    }
    for (const k of this.objects.keys()) {
      for (const preset of this.presets) for (const file of [...this.low(k), ...this.high(k, preset)]) {
        demand(this.files.has(file), `${file} is not listed`);
      }
    }
  }

  /** @param {CampusFile} row */
  #add(row) {
    demand(isWhole(row.bytes, 1, MOST) && isWhole(row.crc32, 0, MOST), "a file without size");
    this.files.set(row.file, row);
  }

  /** @param {Material} one */
  #checkMaterial({ base, channels, wrap, color, opacity, alpha, cutoff }) {
    demand(base === null || NAME.test(base), "an impossible base");
    demand(Array.isArray(channels) && Array.isArray(wrap) && wrap.length === 2, "a material without channels");
    demand(isVector(color, 3) && Number.isFinite(opacity), "a material without colour");
    demand(["opaque", "mask", "blend"].includes(alpha) && (cutoff === null || Number.isFinite(cutoff)), "an impossible alpha");
  }

  /** @param {CampusObject} one */
  #checkObject({ name, label, parts, box, barycentre, viewpoint, materials, lightmap, meshes, record, icon, rank }) {
    demand(NAME.test(name) && typeof label === "string" && Array.isArray(parts), "an object without name");
    demand(icon === undefined || typeof icon === "string", "an icon that is not a name");
    demand(rank === undefined || isWhole(rank, 0, MOST), "an impossible rank");
    demand(isVector(box, 6) && isVector(barycentre, 3), "an object without place");
    demand(isVector(viewpoint?.position, 3) && isVector(viewpoint?.direction, 3), "an object without viewpoint");
    demand(Array.isArray(materials) && materials.every((m) => this.materials[m]), "a material that is not there");
    demand(lightmap === null || NAME.test(lightmap), "an impossible lightmap");
    demand(Array.isArray(meshes) && meshes.length > 0, "an object without mesh");
    for (const mesh of meshes) {
      demand(MESH.test(mesh.file), "a mesh of another name");
      this.#add(mesh);
    }
    if (record === undefined) return;
    demand(RECORD.test(record?.file), "a record of another name");
    demand(isWhole(record.bytes, 0, LONGEST) && isWhole(record.crc32, 0, MOST), "a record without size");
  }

  /** The files of an object in low detail: its coarsest mesh, and textures of the least size. @param {number} k */
  low(k) {
    return this.#once(`${k}`, () => [this.objects[k].meshes[0].file, ...this.#textures(k, LEAST)]);
  }

  /** Lists of files, which every frame asks for. @param {string} key @param {() => string[]} make */
  #once(key, make) {
    const known = this.#lists.get(key) ?? make();
    this.#lists.set(key, known);
    return known;
  }

  /** Its files in the detail of a preset: the finest mesh, textures, lightmap. @param {number} k
   * @param {Preset} preset */
  high(k, { diffuse, light }) {
    const { meshes, lightmap } = this.objects[k], last = meshes[meshes.length - 1].file;
    return this.#once(`${k} ${diffuse} ${light}`, () => [last, ...this.#textures(k, diffuse),
      ...(lightmap === null ? [] : [textureFile(lightmap, light, "l")])]);
  }

  /** @param {number} k @param {number} size */
  #textures(k, size) {
    const files = this.objects[k].materials.flatMap((m) => {
      const { base, channels } = this.materials[m];
      return base === null ? [] : CHANNELS.filter((c) => channels.includes(c)).map((c) => textureFile(base, size, c));
    });
    return [...new Set(files)];
  }
}

/** @param {string} base @param {number} size @param {string} channel */
export const textureFile = (base, size, channel) => `textures/${base}_${size}_${channel}.jpg`;
