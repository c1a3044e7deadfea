// A texture that holds exactly the requested levels.
//
// GL allocates a pyramid at once and cannot free one of its levels. So the storage is as large as the
// finest level present, and another storage replaces it when that changes: common levels are copied on
// the GPU (exactly, as sRGB of 8 bits survives that), new ones are uploaded in stripes, and only then is
// the old storage freed. Until then both count. Textures of a renderer take turns, so that at most one is
// present twice.
//
// A preview, an image of one level, may be shown first: it fills the storage of its level, and the exact
// levels overwrite it there.
//
// Materials keep referring to the same object: three.js finds the new storage behind it, as textures
// with equal settings share that of their source.
//
// Tried: `needsUpdate`, which uploads all levels again; RGB, which in sRGB comes out black.

import {
  Box2,
  DataTexture,
  LinearFilter,
  LinearMipmapLinearFilter,
  NoColorSpace,
  RepeatWrapping,
  SRGBColorSpace,
  Vector2,
} from "three";
import { DecoderWorkers, HEAD_MAX, decodePreview, openPtm } from "ptm-decoder";
import { withOffset } from "ptm-client";
import { TEXEL_BYTES, pyramidBytes } from "./budget.js";
import { RangeFile } from "./range-file.js";

/** @typedef {import("three").WebGLRenderer} WebGLRenderer */
/** @typedef {Awaited<ReturnType<import("ptm-decoder").Ptm["image"]>>} Image */

/**
 * An image of one level (docs/formats/hints.md).
 * @typedef {object} Preview
 * @property {string | URL} file
 * @property {number} level
 * @property {number} bytes
 * @property {boolean} [exact]
 */

/**
 * @typedef {object} TextureOptions
 * @property {DecoderWorkers} [workers] that decode; all textures without share some
 * @property {number[]} [ends] of the levels, from the index: saves the request that determines them
 * @property {Preview[]} [previews] from the index, ascending by level: with `ends`, `sizes` and
 *   `components`
 * @property {{width: number, height: number}[]} [sizes] of all levels, coarsest first
 * @property {number[]} [offsets] of the levels, from the index: what is added to their colours
 * @property {number} [components] of the texture: 2 and 4 have alpha
 * @property {number[]} [color] red, green, blue, 0 to 255: shown before the first level
 * @property {number} [wrapS] `RepeatWrapping` by default
 * @property {number} [wrapT]
 * @property {boolean} [linear] whether its numbers are no colours
 * @property {number} [channel] number of the coordinates that it uses; 0 by default
 */

/** Bytes of the first request where the ends of the levels are unknown. */
const FIRST = 4096;
/** Levels of fewer texels wait for the next: they are not worth a storage. */
const LEAST = 32 * 32;
/** Bytes of one upload, and ms of uploads before others have their turn. */
const STRIPE = 2 ** 18;
const PATIENCE = 4;

/** @type {DecoderWorkers | undefined} */
let shared;
/**
 * The current change of storage of each renderer.
 * @type {WeakMap<WebGLRenderer, Promise<unknown>>}
 */
const turns = new WeakMap();
/**
 * The downloaded previews of files by address; null for those that cannot be shown.
 * @type {WeakMap<RangeFile, Map<string, Uint8Array<ArrayBuffer> | null>>}
 */
const images = new WeakMap();

/** See `refine`. Its rows begin at the top, as glTF has it. */
export class PtmTexture extends DataTexture {
  #renderer;
  #options;
  /** @type {import("ptm-decoder").Ptm | undefined} */
  #ptm;
  #wanted = -1;
  #exactly = true;
  /** The finest level up to which all present ones are exact. */
  #sure = -1;
  /** The current call of `refine`. @type {symbol | undefined} */
  #call;
  /** @type {Promise<boolean>} */
  #answer = Promise.resolve(true);
  #control = new AbortController();
  /** Storages that the GPU has, and their bytes. @type {Map<DataTexture, number>} */
  #storages = new Map();

  /**
   * Settings that samplers depend on (wraps, filters, anisotropy) must precede `refine`.
   * @param {WebGLRenderer} renderer the one that shows it
   * @param {RangeFile | string | URL} file textures that share a file download it once
   * @param {TextureOptions} [options]
   */
  constructor(renderer, file, options = {}) {
    super(null, 1, 1);
    this.#renderer = renderer;
    this.#options = options;
    this.file = file instanceof RangeFile ? file : new RangeFile(file);
    /** The finest level present, -1 for none. */
    this.level = -1;
    this.colorSpace = options.linear ? NoColorSpace : SRGBColorSpace;
    this.channel = options.channel ?? 0;
    this.magFilter = LinearFilter;
    this.minFilter = LinearMipmapLinearFilter;
    this.wrapS = options.wrapS ?? RepeatWrapping;
    this.wrapT = options.wrapT ?? RepeatWrapping;
    this.#blank();
    renderer.domElement.addEventListener("webglcontextlost", this.#lost);
    renderer.domElement.addEventListener("webglcontextrestored", this.#restored);
  }

  /** Texels across its finest level; 0 without `sizes`. */
  get finest() {
    return this.#options.sizes?.at(-1)?.width ?? 0;
  }

  /** Its bytes on the GPU: while storage is exchanged, of the old and the new. */
  get gpuBytes() {
    return [...this.#storages.values()].reduce((sum, bytes) => sum + bytes, 0);
  }

  /**
   * Fetches, decodes and shows the levels up to this one, coarsest first, and gives finer ones
   * back; -1 leaves nothing but the colour. Levels larger than the GPU's limit are left out.
   * Where a preview takes fewer bytes it is shown first, and the exact levels replace it. Cancels earlier
   * requests. After a loss of the context the levels are restored from the
   * downloaded bytes.
   *
   * Rejects as `openPtm` and decoding do, and with an Error that names the file if it
   * does not come; levels that were shown before stay.
   *
   * @param {number} level
   * @param {{exact?: boolean}} [options] whether to go on after a preview of the level; true by default
   * @returns {Promise<boolean>} true when the levels are shown, false if the call was cancelled
   */
  refine(level, { exact = true } = {}) {
    if (this.#call && level === this.#wanted && exact === this.#exactly) return this.#answer;
    this.#control.abort();
    this.#wanted = level;
    this.#exactly = exact;
    this.#call = Symbol();
    return (this.#answer = this.#reach(level, this.#call));
  }

  /** The same image with storage of its own, which begins with nothing. */
  clone() {
    const { wrapS, wrapT } = this;
    const options = { ...this.#options, wrapS, wrapT };
    return /** @type {this} */ (new PtmTexture(this.#renderer, this.file, options));
  }

  /** Frees everything; the texture cannot be used any more. */
  dispose() {
    this.#call = undefined;
    this.#control.abort();
    this.#renderer.domElement.removeEventListener("webglcontextlost", this.#lost);
    this.#renderer.domElement.removeEventListener("webglcontextrestored", this.#restored);
    this.#free();
  }

  // Now, since objects of a lost context cannot be freed in the next one.
  #lost = () => {
    this.#control.abort();
    for (const storage of this.#storages.keys()) if (storage !== this) storage.dispose();
    this.#free();
    this.#blank();
  };

  #restored = () => {
    if (!this.#call && this.#wanted >= 0) this.refine(this.#wanted, { exact: this.#exactly });
  };

  #free() {
    super.dispose();
    this.#storages.delete(this);
    this.level = this.#sure = -1;
  }

  /** Shows only the colour. */
  #blank() {
    const [r, g, b] = this.#options.color ?? [128, 128, 128];
    this.source = new DataTexture(new Uint8Array([r, g, b, 255]), 1, 1).source;
    this.mipmaps = [];
    this.needsUpdate = true;
    this.#storages.set(this, TEXEL_BYTES);
  }

  /**
   * @param {number} level
   * @param {symbol} call
   */
  async #reach(level, call) {
    try {
      while (this.#call === call) {
        const { signal } = (this.#control = new AbortController());
        try {
          await contextOf(this.#renderer);
          signal.throwIfAborted();
          if (level < this.level) await this.#hold(level, [], signal);
          await this.#rise(level, signal);
          return true;
        } catch (error) {
          if (!signal.aborted) throw error;
        }
      }
      return false;
    } finally {
      if (this.#call === call) this.#call = undefined;
    }
  }

  /**
   * By a preview first, if one is better than the bytes that the exact levels lack.
   * @param {number} level
   * @param {AbortSignal} signal
   */
  async #rise(level, signal) {
    const { ends = [], previews = [], sizes } = this.#options;
    if (sizes) level = Math.min(level, sizes.length - 1);
    while (level > this.level) {
      const preview = this.#previewOf(level);
      if (!preview || preview.level <= this.level) break;
      if (level < ends.length && ends[level] - this.file.held <= preview.bytes) break;
      if (await this.#preview(preview, Math.min(level, preview.level), signal)) break;
    }
    if (!this.#exactly && this.level >= level) return;
    const whole = previews.at(-1);
    // The finest level may be an image twice, of which the later one is exact.
    if (whole?.exact && whole.level === level && whole.level > this.#sure) {
      await this.#preview(whole, level, signal);
    }
    const last = previews.length ? Math.min(level, ends.length - 1) : level;
    // Levels that only previews have are not replaced by fewer.
    if (last > this.#sure && last >= this.level) await this.#riseExactly(last, signal);
  }

  /**
   * The coarsest preview that shows a level, or the finest.
   * @param {number} level
   */
  #previewOf(level) {
    const { previews = [], sizes = [] } = this.#options, known = images.get(this.file);
    const most = this.#renderer.capabilities.maxTextureSize;
    const usable = previews.filter((preview) => {
      const { width, height } = sizes[preview.level];
      return Math.max(width, height) <= most && known?.get(String(preview.file)) !== null;
    });
    return usable.find((preview) => preview.level >= level) ?? usable.at(-1);
  }

  /**
   * Shows a preview; returns whether it could.
   * @param {Preview} preview
   * @param {number} level
   * @param {AbortSignal} signal
   */
  async #preview({ file, level: finest, exact }, level, signal) {
    const { components = 3, sizes = [] } = this.#options, url = String(file);
    const known = images.get(this.file) ?? new Map();
    images.set(this.file, known);
    try {
      if (!known.has(url)) {
        const response = await fetch(url, { signal });
        if (!response.ok) throw new Error(`${response.status} ${response.statusText}`);
        known.set(url, new Uint8Array(await response.arrayBuffer()));
      }
      const options = {
        sizes: sizes.slice(0, finest + 1), levels: level + 1, components: components % 2 ? 3 : 4,
      };
      const bytes = known.get(url);
      const levels = typeof OffscreenCanvas === "function"
        ? await this.#workers.decodePreview(bytes, options) : await decodePreview(bytes, options);
      signal.throwIfAborted();
      await this.#hold(level, levels, signal, exact ? level : -1);
      return true;
    } catch (error) {
      if (signal.aborted) throw error;
      known.set(url, null);
      console.warn(`three-ptm: ${url}: ${error}; left out`);
      return false;
    }
  }

  get #workers() {
    return this.#options.workers ?? (shared ??= new DecoderWorkers());
  }

  /**
   * Decodes the downloaded bytes and the range after them; requests bytes with a wrong checksum again.
   * @param {number} level
   * @param {AbortSignal} signal
   */
  async #riseExactly(level, signal) {
    try {
      await this.#decode(level, signal);
    } catch (error) {
      const { code } = /** @type {{code?: string}} */ (error);
      if (signal.aborted || (code !== "PTM-I105" && code !== "PTM-I108")) throw error;
      console.warn(`three-ptm: ${this.file.url}: ${error}; asked for once more`);
      this.file.forget(this.#ptm?.levels[this.#sure + 1]?.offset ?? 0);
      this.#ptm = undefined;
      await this.#decode(level, signal);
    } finally {
      await this.file.settle(signal);
    }
  }

  /**
   * @param {number} level
   * @param {AbortSignal} signal
   */
  async #decode(level, signal) {
    const workers = this.#workers;
    this.file.until = this.#options.ends?.[level] ?? FIRST;
    const read = this.file.read.bind(this.file);
    this.#ptm ??= await openPtm(read, { signal, first: HEAD_MAX });
    const { levels } = this.#ptm;
    const most = this.#renderer.capabilities.maxTextureSize;
    const fit = levels.findLastIndex(({ width, height }) => Math.max(width, height) <= most);
    const to = Math.min(level, fit);
    if (to <= this.#sure) return;
    this.file.until = levels[to].offset + levels[to].length;
    /** @type {Image[]} */
    let images = [];
    for await (const image of this.#ptm.decode({ to, workers, signal })) {
      if (image.level <= this.#sure) continue;
      images.push(image);
      const small = image.level < this.level || image.width * image.height < LEAST;
      if (image.level < to && small) continue;
      await this.#hold(image.level, images, signal);
      images = [];
    }
  }

  /**
   * Storage of the levels up to this one, filled with present levels and images.
   * @param {number} level
   * @param {Image[]} images levels that follow each other, up to this one
   * @param {AbortSignal} signal
   * @param {number} sure up to which level the images are exact
   */
  #hold(level, images, signal, sure = level) {
    return inTurn(this.#renderer, async () => {
      signal.throwIfAborted();
      if (level === this.level) {
        for (const image of images) await this.#upload(image, this, level - image.level, signal);
        if (images.length) this.#sure = sure;
        return;
      }
      if (level < 0) {
        this.#free();
        this.#blank();
        return;
      }
      const next = this.#storage(level);
      try {
        for (const image of images) await this.#upload(image, next, level - image.level, signal);
        const first = images[0]?.level ?? level + 1;
        for (let kept = Math.min(this.level, first - 1); kept >= 0; kept--) {
          const [from, to] = [this.level - kept, level - kept];
          this.#renderer.copyTextureToTexture(this, next, null, null, from, to);
        }
        const bytes = /** @type {number} */ (this.#storages.get(next));
        const exact = images.length ? sure : Math.min(this.#sure, level);
        this.#free();
        this.source = next.source;
        this.mipmaps = next.mipmaps;
        this.#renderer.initTexture(this);
        this.#storages.set(this, bytes);
        this.level = level;
        this.#sure = exact;
      } finally {
        next.dispose();
        this.#storages.delete(next);
      }
    });
  }

  /** @param {number} level */
  #storage(level) {
    const levels = this.#options.sizes ?? /** @type {import("ptm-decoder").Ptm} */ (this.#ptm).levels;
    const sizes = levels.slice(0, level + 1).reverse();
    const [{ width, height }] = sizes;
    const next = new DataTexture(null, width, height);
    const { wrapS, wrapT, magFilter, minFilter, anisotropy, colorSpace } = this;
    Object.assign(next, { wrapS, wrapT, magFilter, minFilter, anisotropy, colorSpace });
    next.mipmaps = sizes.map((size) => ({ data: null, width: size.width, height: size.height }));
    next.source.dataReady = false;
    next.needsUpdate = true;
    this.#renderer.initTexture(next);
    this.#storages.set(next, pyramidBytes(levels, level));
    return next;
  }

  /**
   * @param {Image} image
   * @param {DataTexture} next
   * @param {number} mip
   * @param {AbortSignal} signal
   */
  async #upload({ level, width, height, data }, next, mip, signal) {
    const texels = withOffset(data, TEXEL_BYTES, this.#options.offsets?.[level] ?? 0);
    const source = new DataTexture(texels, width, height);
    const rows = Math.max(Math.floor(STRIPE / (TEXEL_BYTES * width)), 1);
    let began = performance.now();
    for (let y = 0; y < height; y += rows) {
      const stripe = new Box2(new Vector2(0, y), new Vector2(width, Math.min(y + rows, height)));
      this.#renderer.copyTextureToTexture(source, next, stripe, new Vector2(0, y), 0, mip);
      if (performance.now() - began < PATIENCE) continue;
      await new Promise((resolve) => setTimeout(resolve));
      signal.throwIfAborted();
      began = performance.now();
    }
  }
}

/**
 * @param {WebGLRenderer} renderer
 * @param {() => Promise<void>} work
 */
function inTurn(renderer, work) {
  const done = (turns.get(renderer) ?? Promise.resolve()).then(work);
  turns.set(renderer, done.catch(() => {}));
  return done;
}

/**
 * Waits for a context that was lost.
 * @param {WebGLRenderer} renderer
 */
async function contextOf(renderer) {
  if (!renderer.getContext().isContextLost()) return;
  await new Promise((resolve) => {
    renderer.domElement.addEventListener("webglcontextrestored", resolve, { once: true });
  });
}
