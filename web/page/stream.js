// Carries out the requests of the client and passes the answers on.

import { PtmError } from "../ptm/src/index.js";
import { readGlb } from "./data/glb.js";
import { readRecord } from "./data/record.js";
import { PageError } from "./net/errors.js";
import { clock } from "./net/fetcher.js";
import { previewsOf } from "./net/preview-file.js";
import { TextureFile } from "./net/texture-file.js";
import { EXACT, NO_SOURCE } from "./policy/downloads.js";
import { page } from "./words/english.js";
import { fill } from "./words/language.js";

/** @typedef {import("./policy/downloads.js").Request} Request */
/** @typedef {import("./data/site.js").CellRecord} CellRecord */
/** @typedef {import("./data/glb.js").Shape} Shape */
/** @typedef {import("../ptm/src/meshopt.js").ViewDecoder} ViewDecoder */
/** @typedef {{workers: import("../ptm/src/workers.js").Workers, geometry: () => Promise<ViewDecoder>}} Decoders */

/** Seconds until a failed file is requested again. */
const REST = 10;

export class Stream {
  /** @type {Map<number, CellRecord>} */
  records = new Map();
  /** @type {Map<number, Shape[]>} */
  shapes = new Map();
  /** Whether files have arrived since the last look. */
  news = false;
  /** Whether to make no requests at all: texture memory stays unchanged. */
  frozen = false;
  /** Whether only visible textures and cells are fetched, to save data, and to compare with full resolution. */
  saving = false;
  comparing = false;
  /** @type {Request[]} */
  #queue = [];
  /** @type {Set<Request>} */
  #sent = new Set();
  /** The damaged level of a texture. @type {Map<number, number>} */
  #suspect = new Map();
  /** Previews that could not be decoded. @type {Set<number>} */
  #spoilt = new Set();
  #cannotDecode = false;
  #geometry;
  #report;

  /**
   * @param {object} parts
   * @param {import("./data/site.js").Site} parts.site
   * @param {import("./data/site.js").Index} parts.index what the GPU can hold of it
   * @param {import("./policy/client.js").Client} parts.client
   * @param {import("../client/src/locating.js").Locator} parts.locator
   * @param {import("./policy/estimate.js").Estimate} parts.estimate
   * @param {import("./net/fetcher.js").Fetcher} parts.fetcher
   * @param {import("./net/opening.js").Opening | null} parts.opening
   * @param {Decoders} parts.decoders
   * @param {(error: PageError, kind: string, number: number) => void} parts.report
   */
  constructor({ site, index, client, locator, estimate, fetcher, opening, decoders, report }) {
    this.site = site;
    this.client = client;
    this.locator = locator;
    this.estimate = estimate;
    this.fetcher = fetcher;
    this.opening = opening;
    this.workers = decoders.workers;
    this.#geometry = decoders.geometry;
    this.#report = report;
    this.files = site.index.textures.map((row) => new TextureFile(row, this.workers));
    this.previews = previewsOf(index, site.index, this.workers);
  }

  /** Whether to make no requests beyond the screen, or none at all. */
  get rests() {
    const enough = this.saving || this.comparing || document.hidden;
    return this.frozen || (enough && this.client.missing(true) === 0);
  }

  /**
   * Requests all parts of the opening, in their order, and, if the visitor begins with its view, the previews
   * that this needs next on this screen. Returns the columns of textures that the view probably wants: those
   * of its previews, of the first the most. Null without an opening, or elsewhere.
   * @param {import("./gl/viewport.js").Viewport} viewport
   */
  async follow(viewport) {
    const { client: { catalogue: { T, K }, downloads }, fetcher, opening } = this;
    if (!opening) return null;
    fetcher.requests++;
    const next = await opening.next, present = new Float64Array(T * K);
    const steps = [...opening.parts], lines = viewport.across(viewport.angle);
    for (const [number, few] of next ?? []) if (lines > few) steps.push(["preview", number, 0]);
    steps.forEach(([kind, place, end], order) => {
      const preview = kind === "preview";
      const number = preview ? this.previews.findIndex((file) => file.place === place) : place;
      if (number < 0 || (order >= opening.parts.length && this.rests) || !downloads.free(kind, number)) return;
      this.ask(downloads.ask(kind, number, steps.length - order, end));
      if (!preview) return;
      const { texture, row: { level } } = this.previews[number];
      const first = texture * K + 1, share = present[first] || 1 / (2 + order);
      present.fill(share, first, first + level + 1);
    });
    return next && present;
  }

  /**
   * The URL of a file.
   * @param {import("./policy/downloads.js").Kind} kind
   * @param {number} number
   */
  url(kind, number) {
    if (kind === "preview") return this.site.of(this.previews[number].row.file);
    if (kind === "mesh") return this.site.of(this.client.catalogue.meshes[number].file);
    return kind === "texture" ? this.site.texture(number) : this.site.cell(kind, number);
  }

  /** Makes the most urgent requests, as long as the link would run dry. */
  pump() {
    while (!this.rests) {
      const request = this.client.next(this.estimate);
      if (!request) return;
      this.ask(request);
    }
  }

  /**
   * As many requests are on the way as the protocol takes at a time, the most urgent ones.
   * @param {Request} request
   */
  ask(request) {
    this.#queue.push(request);
    this.#send();
  }

  #send() {
    // Requests that pause before another try take no connection.
    const busy = () => [...this.#sent].filter(({ waits }) => !waits).length;
    while (busy() < this.estimate.concurrency && this.#queue.length) {
      const { priority } = this.#queue.reduce((a, b) => (b.priority > a.priority ? b : a));
      const first = this.#queue.findIndex((request) => request.priority === priority);
      const [request] = this.#queue.splice(first, 1);
      this.#sent.add(request);
      this.#fetch(request).finally(() => {
        this.#sent.delete(request);
        this.#send();
        this.pump();
      });
    }
  }

  /** @param {Request} request */
  async #fetch(request) {
    const { kind, number } = request, { client } = this;
    try {
      if (kind === "texture") await this.#texture(request);
      else if (kind === "preview") await this.#preview(request);
      else if (kind === "mesh") await this.#mesh(request);
      else await this.#cell(kind, request);
      this.news = true;
    } catch (fault) {
      const known = fault instanceof PageError;
      const error = known ? fault : new PageError("PTM-V107", String(fault));
      const forGood = error.code === "PTM-V103" || error.code === "PTM-V105";
      client.failed(request, forGood ? Infinity : clock() + REST);
      this.#report(error, kind, number);
    }
  }

  /**
   * @param {"record" | "geometry"} kind
   * @param {Request} request
   */
  async #cell(kind, request) {
    const { client } = this, cell = request.number;
    if (kind === "record") {
      const { cells, textures } = this.site.index;
      const read = (/** @type {Uint8Array} */ body) =>
        readRecord(body, cell, cells.length, textures.length);
      const record = await this.#whole(request, read);
      this.locator.learn(cell, record);
      this.records.set(cell, record);
      client.arrived(request);
      client.learnRecord(cell, record);
    } else {
      const shapes = await this.#shapes(request, cell);
      this.shapes.set(cell, shapes);
      client.arrived(request);
      client.learnGeometry(cell, shapes);
    }
  }

  /**
   * A finer mesh takes the place of a coarser one.
   * @param {Request} request
   */
  async #mesh(request) {
    const { client } = this, { meshes } = client.catalogue;
    const { mesh, cell, error } = meshes[request.number];
    const shapes = await this.#shapes(request, cell);
    const over = meshes.some((row, k) =>
      row.mesh === mesh && row.error <= error && client.downloads.has("mesh", k));
    const before = this.shapes.get(cell) ?? [];
    client.arrived(request);
    if (over) return;
    const others = before.filter((shape) => shape.mesh !== mesh);
    this.shapes.set(cell, [...others, ...shapes.map((shape) => ({ ...shape, mesh }))]);
  }

  /** @param {Request} request @param {number} cell */
  #shapes(request, cell) {
    const textures = this.site.index.textures.length;
    const read = (/** @type {Uint8Array<ArrayBuffer>} */ body) =>
      readShapes(body, cell, textures, this.#geometry);
    return this.#whole(request, read);
  }

  /**
   * A whole file, parsed: from the opening, or else from the host.
   * @template R
   * @param {Request} request
   * @param {(body: Uint8Array<ArrayBuffer>) => R | Promise<R>} read throws or rejects if it is damaged
   * @param {RequestCache} [cache]
   */
  async #whole(request, read, cache = "default") {
    const { kind, number } = request;
    const place = kind === "preview" ? this.previews[number].place : number;
    const part = cache === "default" ? await this.opening?.take(kind, place) : null;
    try {
      if (part) return await read(part);
    } catch {
      // The file itself may be intact.
    }
    return this.fetcher.whole(this.url(kind, number), read, request, cache);
  }

  /** @param {Request} request */
  async #texture(request) {
    const { number, begin, end } = request, file = this.files[number];
    const size = file.row.ends[file.row.ends.length - 1];
    const url = this.url("texture", number), cache = this.#suspect.has(number) ? "no-store" : "default";
    const first = begin === 0 && cache === "default" ? await this.opening?.take("texture", number) : null;
    const part = first && first.length <= size ? { begin, body: first }
      : await this.fetcher.range(url, begin, end, size, request, cache);
    // The bytes before it may be damaged.
    if (part.begin <= file.length) file.append(part.begin, part.body);
    this.client.arrived(request, this.#cannotDecode ? 0 : file.length);
  }

  /** @param {Request} request */
  async #preview(request) {
    const { number } = request, file = this.previews[number];
    const read = (/** @type {Uint8Array<ArrayBuffer>} */ body) => body;
    const cache = this.#spoilt.has(number) ? "no-store" : "default";
    file.bytes = await this.#whole(request, read, cache);
    this.client.arrived(request);
  }

  /**
   * The first levels of a texture by the best source that has arrived, and the loss of that.
   * @param {number} texture
   * @param {number} levels
   */
  async decode(texture, levels) {
    const source = this.client.downloads.source(texture, levels);
    // Damaged bytes are on their way again.
    if (source === NO_SOURCE) throw new Error("not here");
    const { loss } = this.client.catalogue.previews;
    return source === EXACT ? { images: await this.#decodeExact(texture, levels), loss: 0 }
      : { images: await this.#decodePreview(source, levels), loss: loss[source] };
  }

  /**
   * By a preview. One that cannot be decoded is requested once more, then left out.
   * @param {number} number
   * @param {number} levels
   */
  async #decodePreview(number, levels) {
    const file = this.previews[number], { client } = this;
    try {
      return await file.decode(levels);
    } catch (fault) {
      if (!(fault instanceof PtmError)) this.#reportDecoder(fault);
      // Another call has reported it.
      if (!(fault instanceof PtmError) || !file.bytes) throw fault;
      file.bytes = null;
      const again = this.#spoilt.has(number);
      client.losePreview(number, again ? Infinity : 0);
      if (!again) {
        this.#spoilt.add(number);
        const message = fill(page.unshown, { file: file.row.file, reason: fault.message });
        this.#report(new PageError("PTM-V105", message), "preview", number);
      }
      throw fault;
    }
  }

  /** Without a decoder of files previews may still be shown. @param {unknown} fault */
  #reportDecoder(fault) {
    if (this.#cannotDecode || !this.workers.failed) return;
    this.#cannotDecode = true;
    this.#report(new PageError("PTM-V106", fill(page.undecoded, { reason: String(fault) })), "decoder", 0);
    this.files.forEach((_, t) => this.client.lose(t, 0, Infinity));
  }

  /**
   * By the `.ptm`. A damaged level is requested once more; if it is damaged again, the levels below it
   * remain.
   * @param {number} texture
   * @param {number} levels
   */
  async #decodeExact(texture, levels) {
    const file = this.files[texture];
    try {
      const images = await file.decode(levels);
      if (levels > (this.#suspect.get(texture) ?? levels)) this.#suspect.delete(texture);
      return images;
    } catch (fault) {
      // A worker without a decoder has no access to the file.
      if (!(fault instanceof PtmError) || fault.code === "PTM-M103") {
        this.#reportDecoder(fault);
        throw fault;
      }
      // Another call has reported it.
      if (levels > this.client.have[texture]) throw fault;
      const { level = 0 } = /** @type {{level?: number}} */ (fault);
      const kept = level > 0 ? file.row.ends[level - 1] : 0;
      if (fault.code.startsWith("PTM-L")) {
        this.client.lose(texture, kept, Infinity);
        const message = fill(page.partial, { file: file.row.file, reason: fault.message });
        this.#report(new PageError("PTM-V106", message), "texture", texture);
        throw fault;
      }
      file.cut(kept);
      this.client.lose(texture, kept, this.#suspect.get(texture) === level ? Infinity : 0);
      this.#suspect.set(texture, level);
      const message = fill(page.damaged, { file: file.row.file, reason: fault.message });
      this.#report(new PageError("PTM-V105", message), "texture", texture);
      throw fault;
    }
  }
}

/**
 * @param {Uint8Array<ArrayBuffer>} body
 * @param {number} cell
 * @param {number} textures in the index
 * @param {Decoders["geometry"]} decoder
 */
async function readShapes(body, cell, textures, decoder) {
  const loaded = () =>
    decoder().catch((fault) => {
      throw new PageError("PTM-V106", fill(page.noGeometry, { reason: String(fault) }));
    });
  const read = await readGlb(body.buffer, textures, loaded);
  if (read.cell !== cell) throw new Error("is of another cell");
  return read.shapes;
}
