// `?form=gpuii`: the textures of a walk come as interlaced images. A script of its own, which only such visits
// load: it puts the client of interlaced images, their files and their texture memory into the walk.

import { Gpuii } from "./sets/gpuii.js";
import { JoinedMemory } from "./sets/joined-memory.js";
import { piecesOf } from "./sets/pieces.js";
import { rowOf, setsIn } from "./sets/sets.js";
import { showNotice } from "../page/ui/errors.js";
import { objects } from "../page/words/english.js";

/** @typedef {import("./sets/sets.js").TextureSet} TextureSet */

/**
 * Puts steps of interlaced images in place of the levels of a site's textures. Returns a function that prepares the
 * walk for them, or null, after a notice, if the site has none. Rejects with a PageError if they are damaged.
 * @param {import("../page/data/site.js").Site} site
 * @param {WebGL2RenderingContext} gl
 * @param {{opening: unknown}} options of the application: an opening has levels of textures
 * @param {import("../page/net/fetcher.js").Fetcher} fetcher
 */
export async function setsOf(site, gl, options, fetcher) {
  const { index } = site;
  if (!index.sets) {
    showNotice(document, objects.noSets);
    return null;
  }
  const address = site.of(index.sets), urlOf = (/** @type {string} */ file) => new URL(file, address).href;
  const sets = await fetcher.whole(address, (body) =>
    setsIn(JSON.parse(new TextDecoder().decode(body)), index.textures, urlOf, gl));
  options.opening = null;
  site.index = { ...index, textures: index.textures.map((row, t) => rowOf(row, sets[t])) };
  return (/** @type {import("../page/walkthrough.js").Walkthrough} */ walk) => attach(walk, sets);
}

/** @param {import("../page/walkthrough.js").Walkthrough} walk @param {TextureSet[]} sets */
function attach(walk, sets) {
  const { client, client: { catalogue }, gl, picture, rows } = walk, { K, T, memory } = catalogue;
  const normals = walk.index.textures.map((row) => row.normals === true);
  for (let t = 0; t < T; t++) {
    for (let k = 1; k < K; k++) memory[t * K + k] = sets[t].memory[k - 1] ?? memory[t * K + k - 1];
    // The files so far have as many texels as the image.
    rows[t].sizes = sets[t].parts;
  }
  catalogue.whole = sets.reduce((sum, { memory }) => sum + memory[memory.length - 1], 0);
  walk.firstLevels = 1;
  fetchFiles(walk, sets);

  /** @type {Map<number, import("./sets/pieces.js").Piece[]>} */
  const pieces = new Map(), learn = client.learnGeometry.bind(client);
  client.learnGeometry = (cell, shapes) => {
    pieces.set(cell, /** @type {import("../page/data/glb.js").Shape[]} */ (shapes).flatMap((shape) => [
      ...(shape.uvs ? piecesOf(shape, shape.texture, shape.uvs) : []),
      ...(shape.spots ? piecesOf(shape, shape.light, shape.spots) : []),
      ...(shape.frames && normals[shape.relief] ? piecesOf(shape, shape.relief, shape.frames[0]) : []),
    ]));
    learn(cell, shapes);
  };
  const pixel = () => 2 / walk.viewport.across(Math.PI / 2);
  client.policy = () => new Gpuii(client, sets, pieces, pixel, normals);
  walk.policy = "gpuii";
  walk.memory.delete();
  walk.memory = picture.renderer.memory = /** @type {any} */ (new JoinedMemory(gl, sets));
  walk.choose = walk.compare = () => walk.emit("notice", { message: objects.fixed });
}

/** The requests of steps become requests of files. @param {import("../page/walkthrough.js").Walkthrough} walk
 * @param {TextureSet[]} sets */
function fetchFiles({ client, stream, stream: { fetcher } }, sets) {
  const { bytes } = client.downloads, url = stream.url.bind(stream), range = fetcher.range.bind(fetcher);
  const file = (/** @type {number} */ t, begin = bytes[t]) => sets[t].urls[sets[t].step(begin)];
  stream.url = (kind, number) => (kind === "texture" ? file(number) : url(kind, number));
  const of = new Map(sets.flatMap(({ urls }, t) => urls.map((one) => [one, t])));
  fetcher.range = async (one, begin, end, size, ...more) => {
    const t = of.get(one);
    if (t === undefined) return range(one, begin, end, size, ...more);
    const body = await fetcher.whole(one, async (body) => {
      await sets[t].take(sets[t].step(begin), body);
      return body;
    }, ...more);
    return { begin, body };
  };
  // The bytes are with the sets.
  stream.files = /** @type {any} */ (sets.map((set) => ({ row: set, length: 0, append(/** @type {number} */ begin,
    /** @type {Uint8Array} */ { length }) { this.length = begin + length; } })));
}
