// A downloaded preview, and the levels that a worker decodes from it.

import { levelSizes } from "../../client/src/levels.js";
import { loadLater } from "../load-later.js";

/** @typedef {import("../../ptm/src/level-decoder.js").Image} Image */
/** @typedef {import("../../ptm/src/workers.js").Workers} Workers */

export class PreviewFile {
  /** All bytes, once they have arrived. @type {Uint8Array<ArrayBuffer> | null} */
  bytes = null;

  /**
   * @param {import("../data/site.js").Preview} row
   * @param {number} texture
   * @param {import("../data/site.js").TextureRow} all the row of that texture
   * @param {number} place among the previews of the site
   * @param {Workers} workers
   */
  constructor(row, texture, all, place, workers) {
    this.row = row;
    this.place = place;
    this.texture = texture;
    this.all = all;
    this.workers = workers;
  }

  /**
   * The first levels. Throws PtmError PTM-I105 if it is damaged or another.
   * @param {number} levels
   * @returns {Promise<Image[]>}
   */
  async decode(levels) {
    const { bytes, all, row, workers } = this;
    if (!bytes) throw new Error("not here");
    const sizes = levelSizes(all).slice(0, row.level + 1);
    const options = { sizes, levels, components: all.components };
    if (typeof OffscreenCanvas === "function") return workers.decodePreview(bytes, options);
    return (await loadLater()).decodePreview(bytes, options);
  }
}

/**
 * The previews of an index, in its order.
 * @param {import("../data/site.js").Index} index what the GPU can hold of `site`
 * @param {import("../data/site.js").Index} site
 * @param {Workers} workers
 */
export function previewsOf({ textures }, site, workers) {
  const files = site.textures.flatMap(({ previews = [] }) => previews.map(({ file }) => file));
  return textures.flatMap((all, texture) => (all.previews ?? []).map(
    (row) => new PreviewFile(row, texture, all, files.indexOf(row.file), workers)));
}
