// A camera that turns around the middle of an object, by mouse, fingers and keys; as `ptm render` places it.

/** Vertical field of view, radians. */
export const ANGLE = (35 * Math.PI) / 180;
/** Degrees for a pixel of dragging, and per second of a key; growth of the distance for a wheel's pixel. */
const DRAG = 0.4, KEY = 60, WHEEL = 0.0015;
/** Nearest and farthest distance from the middle, diameters of the object. */
const NEAREST = 0.05, FARTHEST = 20;

/** Keys → change of azimuth, elevation (degrees/s) and of the logarithm of the distance (1/s). */
const KEYS = /** @type {Record<string, number[]>} */ ({
  ArrowLeft: [-KEY, 0, 0], ArrowRight: [KEY, 0, 0], ArrowUp: [0, KEY, 0], ArrowDown: [0, -KEY, 0],
  Equal: [0, 0, -1], NumpadAdd: [0, 0, -1], Minus: [0, 0, 1], NumpadSubtract: [0, 0, 1],
});

export class Orbit {
  /** @type {Set<string>} */
  #held = new Set();
  /** @type {Map<number, {x: number, y: number}>} */
  #fingers = new Map();

  /**
   * @param {HTMLCanvasElement} canvas
   * @param {number[]} middle of the object
   * @param {number} diameter of it
   */
  constructor(canvas, middle, diameter) {
    this.canvas = canvas;
    this.middle = middle;
    this.diameter = diameter;
    /** Degrees; diameters, 0 for the least that shows all. */
    this.azimuth = 25;
    this.elevation = 15;
    this.distance = 0;
    const [azimuth, elevation, distance = 0] = location.hash.slice(1).split(",").map(Number);
    if ([azimuth, elevation, distance].every(Number.isFinite)) this.place(azimuth, elevation, distance);
    canvas.focus({ preventScroll: true });
    canvas.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      canvas.setPointerCapture(event.pointerId);
      this.#fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    });
    for (const name of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(name, (event) =>
        this.#fingers.delete(/** @type {PointerEvent} */ (event).pointerId));
    }
    canvas.addEventListener("pointermove", (event) => this.#drag(event));
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.#zoom(Math.exp(event.deltaY * WHEEL));
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

  /** @param {number} azimuth degrees, 0 from +z, 90 from +x @param {number} elevation degrees
   * @param {number} [distance] diameters */
  place(azimuth, elevation, distance = 0) {
    this.azimuth = azimuth % 360;
    this.elevation = Math.max(-90, Math.min(90, elevation));
    this.distance = distance > 0 ? Math.max(NEAREST, Math.min(FARTHEST, distance)) : 0;
  }

  /** Turns as the held keys wish. @param {number} dt s */
  step(dt) {
    for (const key of this.#held) {
      const [turn, rise, away] = KEYS[key];
      this.place(this.azimuth + turn * dt, this.elevation + rise * dt, this.distance);
      if (away) this.#zoom(Math.exp(away * dt));
    }
  }

  /** Eye; right, up and forward; tangents of half the angles. */
  get camera() {
    const aspect = this.canvas.width / this.canvas.height, tall = Math.tan(ANGLE / 2);
    const [turn, rise] = [this.azimuth, this.elevation].map((angle) => (angle * Math.PI) / 180);
    const back = [Math.sin(turn) * Math.cos(rise), Math.sin(rise), Math.cos(turn) * Math.cos(rise)];
    const away = (this.distance || this.#least(aspect, tall)) * this.diameter;
    const eye = this.middle.map((x, k) => x + away * back[k]);
    const ahead = back.map((x) => -x);
    const level = Math.hypot(ahead[0], ahead[2]);
    const right = level < 1e-9 ? [1, 0, 0] : [-ahead[2] / level, 0, ahead[0] / level];
    return { eye, right, up: cross(right, ahead), ahead, away, half: [tall * aspect, tall] };
  }

  /** @param {number} aspect @param {number} tall */
  #least(aspect, tall) {
    return 0.5 / Math.sin(Math.atan(tall * Math.min(1, aspect)));
  }

  /** @param {number} factor */
  #zoom(factor) {
    const { width, height } = this.canvas;
    const distance = this.distance || this.#least(width / height, Math.tan(ANGLE / 2));
    this.place(this.azimuth, this.elevation, distance * factor);
  }

  /** One finger turns, two zoom. @param {PointerEvent} event */
  #drag(event) {
    const before = this.#fingers.get(event.pointerId);
    if (!before) return;
    const spread = this.#spread(), now = { x: event.clientX, y: event.clientY };
    this.#fingers.set(event.pointerId, now);
    if (this.#fingers.size === 1) {
      const [x, y] = [now.x - before.x, now.y - before.y];
      this.place(this.azimuth - x * DRAG, this.elevation + y * DRAG, this.distance);
    } else if (spread > 0 && this.#spread() > 0) {
      this.#zoom(spread / this.#spread());
    }
  }

  /** Distance of two fingers, pixels. */
  #spread() {
    const [one, other] = this.#fingers.values();
    return one && other ? Math.hypot(one.x - other.x, one.y - other.y) : 0;
  }
}

/** @param {number[]} a @param {number[]} b */
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
