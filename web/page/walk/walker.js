// The visitor's body: an upright cylinder that glides along walls, climbs steps, and falls.
//
// The cylinder begins at step height: lower obstacles are climbed. No triangle comes nearer to its
// axis than the radius, or than it already is, and obstacles around the body up to a height do not
// hold it: so a visitor placed inside an object can walk out of it, but not through others. A part of
// a step is shorter than the radius, so no wall is too thin.

import { letThrough, outline, pushed } from "./obstacles.js";
import { BLOCKS, CARRIES } from "./solids.js";

/** @typedef {import("./solids.js").Solids} Solids */
/** @typedef {import("./obstacles.js").Obstacle} Obstacle */
/** @typedef {{eye: number[], yaw: number, pitch: number}} Pose world metres and radians */
/**
 * The visitor's input: −1 to 1, and the pointer's turns since the last time, radians.
 * @typedef {object} Wishes
 * @property {number} forward
 * @property {number} right
 * @property {number} turn to the left
 * @property {number} look upwards
 * @property {boolean} run
 * @property {number} [yaw]
 * @property {number} [pitch]
 */

/** m/s, times, radians/s, radians. */
const WALK = 1.6, RUN = 2.2, TURN = 1.7, STEEPEST = 1.5;
/** Seconds in which speed and the height of the eye nearly reach their targets. */
const SWIFT = 0.07, GLIDE = 0.1;
/** m/s², m/s: gravity, and the fastest fall. */
const GRAVITY = 9.8, TERMINAL = 20;
/** A longer time step is cut to this, s; and it is taken in parts of at most that. */
const LONGEST = 0.25, PART = 0.02;
/** From the eye to the top of the head, and the depth in which a floor is searched, m. */
const FOREHEAD = 0.1, DEEP = 200;
/** A height or a speed that counts as 0, m and m/s. */
const NONE = 1e-4;
/** Share of the radius within which a floor carries. */
const FOOT = 0.5;
/** Share of the height of the eye below which it is furniture that the body may stand in. */
const FURNITURE = 0.75;

/** @param {number} value */
const whole = (value) => (Math.abs(value) < NONE ? 0 : value);

/** Walks on the geometry. */
export class Walker {
  /** @type {Pose} */
  pose = { eye: [0, 0, 0], yaw: 0, pitch: 0 };
  /** Whether the last step changed nothing. */
  still = true;
  /** Height of the floor under the feet; not known until the first step from a place. */
  #feet = NaN;
  /** Height of the eye above its target. */
  #lift = 0;
  #fall = 0;
  /** Whether it was placed outside all cells: then nothing holds it until it is in one. */
  #astray = false;
  #velocity = [0, 0];

  /**
   * @param {object} world
   * @param {Solids} world.solids
   * @param {(eye: number[]) => number} world.locate cell that the eye is in, or -1
   * @param {number[]} world.avatar radius, height of the eye, highest step
   */
  constructor({ solids, locate, avatar: [radius, height, step] }) {
    this.solids = solids;
    this.locate = locate;
    this.radius = radius;
    this.height = height;
    this.climb = step + 1e-3;
  }

  /** Places the eye; it stays exactly there until the first step. @param {Pose} pose */
  place({ eye, yaw, pitch }) {
    this.pose = { eye: [...eye], yaw, pitch };
    this.#feet = NaN;
    this.#velocity = [0, 0];
    this.#lift = this.#fall = 0;
  }

  /** @param {number} dt seconds @param {Wishes} wishes */
  step(dt, { forward, right, turn, look, run, yaw = 0, pitch = 0 }) {
    dt = Math.min(dt, LONGEST);
    const { pose } = this, before = [...pose.eye, pose.yaw, pose.pitch].join();
    pose.yaw += yaw + turn * TURN * dt;
    pose.pitch = Math.max(-STEEPEST, Math.min(STEEPEST, pose.pitch + pitch + look * TURN * dt));
    const speed = (WALK * (run ? RUN : 1)) / Math.max(1, Math.hypot(forward, right));
    const sin = Math.sin(pose.yaw), cos = Math.cos(pose.yaw), late = Math.exp(-dt / SWIFT);
    const wish = [speed * (right * cos - forward * sin), speed * (-right * sin - forward * cos)];
    const way = wish.map((v, k) => v * dt + (this.#velocity[k] - v) * SWIFT * (1 - late));
    this.#velocity = wish.map((v, k) => whole(v + (this.#velocity[k] - v) * late));
    const length = Math.hypot(way[0], way[1]);
    if (Number.isNaN(this.#feet) && length > 0) this.#stand();
    if (!Number.isNaN(this.#feet) && dt > 0) {
      const parts = Math.ceil(Math.max(dt / PART, length / (this.radius / 2)));
      for (let k = 0; k < parts; k++) this.#part(dt / parts, way[0] / parts, way[1] / parts);
    }
    this.still = before === [...pose.eye, pose.yaw, pose.pitch].join();
  }

  /** Finds the floor that the eye was put above: the one at its height, or else any below. */
  #stand() {
    const [x, y, z] = this.pose.eye, feet = y - this.height;
    this.#feet = feet;
    for (const floor of this.#floors(x, z, y - this.height / 4)) {
      const off = Math.abs(floor - feet);
      if (floor < feet - this.climb || (this.#feet !== feet && off > Math.abs(this.#feet - feet))) {
        continue;
      }
      this.#feet = floor;
    }
    this.#lift = feet - this.#feet;
    this.#astray = this.locate(this.pose.eye) < 0;
  }

  /** Heights of the floors under the feet, at most `top`.
   * @param {number} x @param {number} z @param {number} top */
  #floors(x, z, top) {
    const foot = FOOT * this.radius;
    /** @type {number[]} */
    const heights = [];
    const low = [x - foot, top - DEEP, z - foot], high = [x + foot, top, z + foot];
    this.solids.near(low, high, (p, at, kind) => {
      if (!(kind & CARRIES)) return;
      if (outline.cut(p, at, -Infinity, Infinity).distance(x, z) > foot) return;
      const ax = p[at + 3] - p[at], ay = p[at + 4] - p[at + 1], az = p[at + 5] - p[at + 2];
      const bx = p[at + 6] - p[at], by = p[at + 7] - p[at + 1], bz = p[at + 8] - p[at + 2];
      const nx = ay * bz - az * by, ny = az * bx - ax * bz, nz = ax * by - ay * bx;
      const y = p[at + 1] - (nx * (outline.x - p[at]) + nz * (outline.z - p[at + 2])) / ny;
      if (y <= top) heights.push(y);
    });
    return heights;
  }

  /** The distance of the axis from a triangle, with the feet at a height.
   * @param {Obstacle} one @param {number} x @param {number} z @param {number} feet
   * @param {number} [slack] how much deeper it may go into a floor, for slopes */
  #distance({ corners, at, kind }, x, z, feet, slack = this.radius) {
    const bottom = feet + this.climb + (kind & CARRIES ? slack : 0);
    const top = feet + this.height + Math.max(0, this.#lift) + FOREHEAD;
    return outline.cut(corners, at, bottom, top).distance(x, z);
  }

  /** The distances of a body with its feet at a height. @param {number} feet
   * @returns {import("./obstacles.js").Distance} */
  #from(feet) {
    return (one, x, z) => this.#distance(one, x, z, feet);
  }

  /** @param {number} dt @param {number} dx @param {number} dz */
  #part(dt, dx, dz) {
    const { eye } = this.pose, [x0, , z0] = eye, feet = this.#feet;
    const obstacles = this.#around(x0, z0, feet, Math.hypot(dx, dz));
    const [x, z] = pushed(obstacles, this.radius, this.#from(feet), x0 + dx, z0 + dz);
    if (!this.#settle(dt, x, z, obstacles) && (dx || dz)) this.#settle(dt, x0, z0, obstacles);
    this.#lift = whole(this.#lift * Math.exp(-dt / GLIDE));
    eye[1] = this.#feet + this.height + this.#lift;
  }

  /** Obstacles in reach, with their present distances.
   * @param {number} x @param {number} z @param {number} feet @param {number} way */
  #around(x, z, feet, way) {
    const reach = this.radius + way, lowest = feet - (this.#fall && (this.#fall + 1) * PART);
    const highest = feet + this.climb + this.height + Math.max(0, this.#lift) + FOREHEAD;
    const low = [x - reach, lowest, z - reach], high = [x + reach, highest, z + reach];
    /** And their highest points. @type {(Obstacle & {top: number})[]} */
    const near = [];
    let inside = -Infinity;
    this.solids.near(low, high, (corners, at, kind) => {
      if (!(kind & BLOCKS) || this.#astray) return;
      const top = Math.max(corners[at + 1], corners[at + 4], corners[at + 7]);
      if (top <= lowest) return;
      const one = { corners, at, kind, top, now: 0 };
      const furniture = top > inside && top < feet + FURNITURE * this.height;
      if (furniture && this.#distance(one, x, z, feet, 0) === 0) inside = top;
      one.now = this.#distance(one, x, z, feet);
      near.push(one);
    });
    return near.filter(({ top }) => top > inside);
  }

  /** Moves to a point, up or down to the floor; false if that is impossible.
   * @param {number} dt @param {number} x @param {number} z @param {Obstacle[]} obstacles */
  #settle(dt, x, z, obstacles) {
    const { eye } = this.pose, feet = this.#feet;
    const floor = Math.max(-Infinity, ...this.#floors(x, z, feet + this.climb));
    const walks = floor >= feet - (this.#fall ? 0 : this.climb);
    const fall = walks || floor === -Infinity ? 0 : Math.min(TERMINAL, this.#fall + GRAVITY * dt);
    const to = walks ? floor : Math.max(floor, feet - fall * dt);
    if (this.#fits(x, z, to, obstacles) && this.#known(x, z, to, floor)) {
      if (walks) this.#lift += feet - to;
      this.#fall = fall;
      this.#feet = to;
    } else if (to > feet || !this.#fits(x, z, feet, obstacles) || !this.#known(x, z, feet, floor)) {
      return false;
    } else {
      this.#fall = 0;
    }
    eye[0] = x;
    eye[2] = z;
    return true;
  }

  /** @param {number} x @param {number} z @param {number} feet @param {Obstacle[]} obstacles */
  #fits(x, z, feet, obstacles) {
    const [u, , w] = this.pose.eye;
    return letThrough(obstacles, this.radius, this.#from(feet), u, w, x, z);
  }

  /** Whether the known geometry around a place is loaded.
   * @param {number} x @param {number} z @param {number} feet @param {number} floor */
  #known(x, z, feet, floor) {
    const cell = this.locate([x, feet + this.height + this.#lift, z]);
    if (cell < 0) return this.#astray || floor >= feet - this.climb;
    if (!this.solids.has(cell)) return false;
    this.#astray = false;
    return true;
  }
}
