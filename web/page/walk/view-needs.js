// The needs of the view, from item buffers: which levels of textures its pixels want, and which cells are missing.

import { ItemBuffer } from "../gl/item-buffer.js";
import { clock } from "../net/fetcher.js";
import { sightOf } from "../policy/sight.js";

/** Seconds between item buffers. */
const EVERY = 0.1;

export class ViewNeeds {
  /** (T × K) share of the pixels that want each column; null before the first item buffer. @type {Float64Array | null} */
  present = null;
  /** The same of the opening's view, until an item buffer has the room. @type {Float64Array | null} */
  expected = null;
  /** When the item buffer in use was drawn, s; −1 before the first. */
  drawn = -1;
  /** Tests markers against the depth of the item buffer. @type {((camera: import("../gl/camera.js").Camera) => void) | null} */
  probe = null;
  /** When the last item buffer was drawn, whether it has the room, and whether one that has it was read. */
  #last = -1;
  #drew = false;
  #shown = false;
  /** (C) share of the pixels that show the placeholder of each cell. @type {Float64Array} */
  #hidden;

  #gl;
  #client;
  #textures;

  /**
   * @param {WebGL2RenderingContext} gl
   * @param {import("../policy/client.js").Client} client
   * @param {import("../data/site.js").TextureRow[]} textures
   */
  constructor(gl, client, textures) {
    this.#gl = gl;
    this.#client = client;
    this.#textures = textures;
    this.items = new ItemBuffer(gl);
    this.#hidden = new Float64Array(client.catalogue.C);
  }

  /** Begins anew in a context that was lost. */
  restore() {
    this.items = new ItemBuffer(this.#gl);
  }

  /** Seconds since the item buffer in use was drawn; null before the first. */
  get age() {
    return this.drawn < 0 ? null : clock() - this.drawn;
  }

  /** Takes columns as those of the view, until an item buffer has the room. @param {Float64Array} present */
  expect(present) {
    if (this.#shown) return;
    this.expected = present;
    this.#see(present);
  }

  /** Takes an item buffer that can be read. @param {number} now */
  read(now) {
    const reading = this.items.poll(now);
    if (!reading) return;
    this.drawn = reading.drawn;
    this.#shown ||= this.#drew;
    if (this.#shown) this.expected = null;
    const { present, hidden } = sightOf(reading, this.#client.catalogue);
    this.#hidden = hidden;
    this.#see(this.expected ?? present);
  }

  /** @param {Float64Array} present */
  #see(present) {
    this.present = present;
    this.#client.sees(present, this.#hidden);
  }

  /**
   * Draws an item buffer, if the view has turned since the last one and it is time.
   * @param {import("./picture.js").Picture} picture
   * @param {import("../gl/viewport.js").Viewport} viewport
   * @param {import("../gl/camera.js").Camera} camera
   * @param {{now: number, stands: boolean, room: boolean}} frame s; whether the visitor stands, and whether the
   *   picture has his cell
   */
  draw(picture, viewport, camera, { now, stands, room }) {
    const { items } = this;
    const every = stands ? items.fence.pause(EVERY) : EVERY;
    if (picture.turned <= this.#last || now - this.#last < every || items.busy) return;
    this.#last = now;
    this.#drew = room;
    items.draw(camera, picture, viewport, this.#textures, now, this.probe);
  }
}
