// A picture that is moved and enlarged by mouse, fingers and keys.

/** Pixels per second of a key; growth for a wheel's pixel, and per second of a key. */
const KEY = 600, WHEEL = 0.0015, GROW = 1.2;
/** Screen pixels of a texel, at most; and the least size, as a share of what shows the whole image. */
const LARGEST = 32, SMALLEST = 0.25;

const KEYS = /** @type {Record<string, number[]>} */ ({
  ArrowLeft: [1, 0, 0], ArrowRight: [-1, 0, 0], ArrowUp: [0, 1, 0], ArrowDown: [0, -1, 0],
  Equal: [0, 0, 1], NumpadAdd: [0, 0, 1], Minus: [0, 0, -1], NumpadSubtract: [0, 0, -1],
});

export class Panning {
  /** @type {Set<string>} */
  #held = new Set();
  /** @type {Map<number, number[]>} */
  #fingers = new Map();

  /** @param {HTMLCanvasElement} canvas @param {number} width of the image @param {number} height */
  constructor(canvas, width, height) {
    this.canvas = canvas;
    this.width = width;
    this.height = height;
    /** Pixels of a texel, 0 for the largest that shows the whole image; the image's middle, pixels from
     * that of the canvas. */
    this.scale = 0;
    this.shift = [0, 0];
    canvas.focus({ preventScroll: true });
    canvas.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      canvas.setPointerCapture(event.pointerId);
      this.#fingers.set(event.pointerId, this.#at(event));
    });
    for (const name of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(name, (event) =>
        this.#fingers.delete(/** @type {PointerEvent} */ (event).pointerId));
    }
    canvas.addEventListener("pointermove", (event) => this.#drag(event));
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.#grow(Math.exp(-event.deltaY * WHEEL), this.#at(event));
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => {
      // The release of a key that is held together with these is not reported.
      if (event.ctrlKey || event.metaKey || event.altKey) return this.#held.clear();
      if (!(event.code in KEYS)) return;
      event.preventDefault();
      this.#held.add(event.code);
    });
    canvas.addEventListener("keyup", (event) => this.#held.delete(event.code));
    canvas.addEventListener("blur", () => this.#held.clear());
  }

  /** Pixels of a texel that show the whole image. */
  get #fitting() {
    return Math.min(this.canvas.width / this.width, this.canvas.height / this.height);
  }

  /** Pixels of a texel of the whole image. */
  get pixels() {
    return this.scale || this.#fitting;
  }

  /** @param {number} scale pixels of a texel, 0 for the whole image @param {number[]} [shift] pixels */
  place(scale, shift = [0, 0]) {
    this.scale = scale > 0 ? this.#bounded(scale) : 0;
    // Some of the image stays on the canvas.
    const sides = [this.width, this.height].map((side) => side * this.pixels);
    const whole = [this.canvas.width, this.canvas.height];
    this.shift = shift.map((x, k) => Math.max(-1, Math.min(1, (2 * x) / (sides[k] + 0.8 * whole[k]))) * (sides[k] + 0.8 * whole[k]) / 2);
  }

  /** @param {number} dt s */
  step(dt) {
    for (const key of this.#held) {
      const [x, y, larger] = KEYS[key];
      if (larger) this.#grow(Math.exp(larger * GROW * dt), [0, 0]);
      else this.place(this.scale, [this.shift[0] + x * KEY * dt, this.shift[1] + y * KEY * dt]);
    }
  }

  /** Left, bottom, right and top of the image in the coordinates of the screen, -1 to 1. */
  get box() {
    const { width, height } = this.canvas, { pixels, shift: [x, y] } = this;
    const [across, down] = [(this.width * pixels) / width, (this.height * pixels) / height];
    const [right, below] = [(2 * x) / width, (2 * y) / height];
    return [right - across, -below - down, right + across, -below + down];
  }

  /** @param {number} scale */
  #bounded(scale) {
    const fitting = this.#fitting;
    return Math.max(SMALLEST * Math.min(1, fitting), Math.min(Math.max(LARGEST, 2 * fitting), scale));
  }

  /** Enlarges around a place. @param {number} factor @param {number[]} place pixels from the middle */
  #grow(factor, place) {
    const before = this.pixels, scale = this.#bounded(before * factor);
    this.place(scale, this.shift.map((x, k) => place[k] + (x - place[k]) * (scale / before)));
  }

  /** Pixels from the middle of the canvas. @param {{offsetX: number, offsetY: number}} event */
  #at({ offsetX, offsetY }) {
    const ratio = this.canvas.width / Math.max(1, this.canvas.clientWidth);
    return [offsetX * ratio - this.canvas.width / 2, offsetY * ratio - this.canvas.height / 2];
  }

  /** @param {PointerEvent} event */
  #drag(event) {
    const before = this.#fingers.get(event.pointerId);
    if (!before) return;
    const { spread, middle } = this.#hand();
    this.#fingers.set(event.pointerId, this.#at(event));
    const after = this.#hand();
    this.place(this.scale, this.shift.map((x, k) => x + after.middle[k] - middle[k]));
    if (spread > 0 && after.spread > 0) this.#grow(after.spread / spread, after.middle);
  }

  /** Distance of two fingers, pixels, or 0; and the middle of all. */
  #hand() {
    const places = [...this.#fingers.values()], [one, other] = places;
    const middle = [0, 1].map((k) => places.reduce((sum, place) => sum + place[k], 0) / places.length);
    return { middle, spread: other ? Math.hypot(one[0] - other[0], one[1] - other[1]) : 0 };
  }
}
