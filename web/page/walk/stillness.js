// Measures how long the visitor has not moved.

import { STILL_DEGREES, STILL_METRES, STILL_SECONDS } from "../policy/constants.js";

/** @typedef {import("./walker.js").Pose} Pose */

export class Stillness {
  /** Time of the last movement, s. */
  moved = 0;
  /** @type {Pose} */
  #from = { eye: [0, 0, 0], yaw: 0, pitch: 0 };
  #place = "";

  /** Whether the pose has changed at all. @param {Pose} pose @param {number} now s */
  takes({ eye, yaw, pitch }, now) {
    const from = this.#from, way = Math.hypot(...eye.map((x, k) => x - from.eye[k]));
    const turn = Math.max(Math.abs(yaw - from.yaw), Math.abs(pitch - from.pitch));
    if (way > STILL_METRES || turn > STILL_DEGREES * Math.PI / 180) {
      this.moved = now;
      this.#from = { eye: [...eye], yaw, pitch };
    }
    const place = [...eye, yaw, pitch].join(), other = place !== this.#place;
    this.#place = place;
    return other;
  }

  /** Whether the eye has not moved for a second. @param {number} now */
  lasts(now) {
    return now - this.moved >= STILL_SECONDS;
  }
}
