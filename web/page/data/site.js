// The settings of the page, the index, and the URLs of the files that the index names.

import { levelSizes } from "../../client/src/levels.js";

/**
 * @typedef {object} SiteConfig
 * @property {string} index URLs, relative to the page
 * @property {string} worker
 * @property {string} wasm
 * @property {string} [poster]
 * @property {string} title
 * @property {string} [tour] URL of the tour
 * @property {string} [catalogue] and of its plain page
 *
 * @typedef {object} Preview
 * @property {string} file
 * @property {number} level
 * @property {number} width
 * @property {number} height
 * @property {number} bytes
 * @property {number} difference
 * @property {boolean} [exact]
 *
 * @typedef {object} TextureRow
 * @property {string} file
 * @property {number} width
 * @property {number} height
 * @property {number} components
 * @property {number} texelBytes
 * @property {number} gpuTexelBytes
 * @property {number[]} ends
 * @property {number[]} differences
 * @property {number[]} [offsets]
 * @property {Preview[]} [previews]
 * @property {number[]} color
 * @property {string} [relief]
 * @property {boolean} [normals]
 * @property {number} [light]
 * @property {Probe} [probe]
 *
 * @typedef {object} Probe a panorama of light, as seen from a point of a cell (docs/formats/hints.md)
 * @property {number} white
 * @property {number} mean
 * @property {number[]} centre
 * @property {number[]} low corner of the box in which it is mirrored
 * @property {number[]} high
 *
 * @typedef {object} LightRow the curve and the surroundings of all light (docs/formats/hints.md)
 * @property {number} stops
 * @property {number} [hue] the multiple of the hue of codes that lightmaps have
 * @property {"plain" | "neutral" | "agx"} tone
 * @property {number[]} [sky]
 * @property {number[]} [ground]
 *
 * @typedef {object} CellRow
 * @property {string} name
 * @property {number[]} box
 * @property {boolean} [standing]
 * @property {number[]} [exposure] of red, green and blue in the picture that is seen from it
 * @property {string} record
 * @property {string} geometry
 * @property {number} recordBytes
 * @property {number} geometryBytes
 *
 * @typedef {object} Viewpoint
 * @property {string} name
 * @property {string} description
 * @property {number[]} position
 * @property {number[]} direction
 * @property {number} fieldOfView
 * @property {number} cell
 * @property {string} [thumbnail]
 * @property {{text: string, tag: string} | null} [title] its name in a tour, and the language of that
 *
 * @typedef {object} Index
 * @property {number} schema
 * @property {number[]} avatarSize
 * @property {Viewpoint[]} viewpoints
 * @property {TextureRow[]} textures
 * @property {CellRow[]} cells
 * @property {LightRow} [light]
 * @property {{cell: number, box: number[], errors: number[], files: string[], bytes: number[]}[]} [meshes]
 * @property {import("../../systems/octree/statues.js").OctreeRow[]} [octrees]
 * @property {string} [sets] the document of interlaced images
 *
 * @typedef {object} Leaf
 * @property {number[][]} points
 * @property {number[][]} faces
 *
 * @typedef {object} CellRecord
 * @property {number} cell
 * @property {number[]} visible
 * @property {number[]} adjacent
 * @property {number[]} ach
 * @property {number} floor
 * @property {number[][]} textures
 * @property {number[][]} [need]
 * @property {Leaf[]} leaves
 * @property {{neighbour: number, area: number, polygon: number[][], passage?: boolean}[]} portals
 */

/** The schema of the index that this page reads. */
const SCHEMA = 3;

/** @returns {SiteConfig} */
export function readConfig() {
  return JSON.parse(document.getElementById("site")?.textContent ?? "{}");
}

/** A site: its index, and the URLs of the files in it. */
export class Site {
  /**
   * @param {Index} index
   * @param {string} address of the index
   */
  constructor(index, address) {
    if (index.schema !== SCHEMA) {
      throw new Error(`the index has schema ${index.schema}, not ${SCHEMA}`);
    }
    for (const { differences, previews = [] } of index.textures) {
      // The tables of levels would not end.
      if (!previews.every(({ level }) => level in differences)) throw new Error("a preview of no level");
    }
    if (!index.viewpoints.every(({ position, direction }) => [...position, ...direction].every(Number.isFinite))) {
      throw new Error("a view of no place");
    }
    const { light: { stops = 1, sky = [], ground = [] } = {}, cells } = index;
    const bright = [stops, ...sky, ...ground, ...cells.flatMap(({ exposure: [r, g, b] = [1, 1, 1] }) => [r, g, b])];
    if (!bright.every((number) => number >= 0 && number < Infinity)) throw new Error("light of no level");
    this.index = index;
    this.address = address;
  }

  /**
   * @param {"record" | "geometry"} kind
   * @param {number} cell
   */
  cell(kind, cell) {
    return this.of(this.index.cells[cell][kind]);
  }

  /** @param {number} texture */
  texture(texture) {
    return this.of(this.index.textures[texture].file);
  }

  /** @param {string} url relative to the index */
  of(url) {
    return new URL(url, this.address).href;
  }
}

/**
 * An index without the levels that a GPU cannot hold, and without those that only their previews reached.
 * @param {Index} index
 * @param {number} side texels at most
 * @param {boolean} [matt] whether nothing reflects: probes have no levels then
 * @returns {Index}
 */
export function fitting(index, side, matt) {
  const textures = index.textures.map((row) => {
    if (matt && row.probe) {
      return { ...row, probe: undefined, previews: [], ends: [], differences: [], offsets: [] };
    }
    let beyond = 0;
    while (Math.max(row.width, row.height) >> beyond > side) beyond++;
    const kept = row.ends.length - beyond;
    const previews = (row.previews ?? []).filter(({ width, height }) => Math.max(width, height) <= side);
    const levels = Math.max(kept, (previews.at(-1)?.level ?? 0) + 1);
    return {
      ...row, width: row.width >> beyond, height: row.height >> beyond, previews,
      ends: row.ends.slice(0, kept), differences: row.differences.slice(0, levels),
      offsets: row.offsets?.slice(0, levels),
    };
  });
  return { ...index, textures };
}

/**
 * The sizes and offsets of a texture's levels, coarsest first, and the bytes of a texel on the GPU.
 * @param {TextureRow} row
 */
export function levelsOf(row) {
  const sizes = levelSizes(row);
  return { sizes, offsets: row.offsets ?? sizes.map(() => 0), channels: row.gpuTexelBytes };
}
