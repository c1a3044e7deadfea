// Random eyes of headsets: how far their cameras and their union are off. One line of JSON.
// node eyes.mjs PAGE

import { pathToFileURL } from "node:url";

const PAGE = process.argv[2];
const { cameraOfEye, headingOf, turned, unionOf } = await import(pathToFileURL(`${PAGE}/xr/eyes.js`));
const { frustumOf } = await import(pathToFileURL(`${PAGE}/space/frustum.js`));

let seed = 1;
const random = (low, high) => low + (high - low) * ((seed = (seed * 48271) % 2147483647) / 2147483647);
const dot = (a, b) => a.reduce((sum, x, k) => sum + x * b[k], 0);

/** Axes of a head with yaw, pitch and roll. */
function axesOf(yaw, pitch, roll) {
  const [s, c] = [Math.sin(pitch), Math.cos(pitch)], [sr, cr] = [Math.sin(roll), Math.cos(roll)];
  // Roll about the back axis, then pitch about the right one, then yaw.
  const axes = [[cr, sr, 0], [-sr, cr, 0], [0, 0, 1]];
  return axes.map(([x, y, z]) => turned([x, c * y - s * z, s * y + c * z], yaw));
}

/** A projection of WebXR from slopes to the sides. */
function projectionOf(left, right, down, up, near, far) {
  const p = new Array(16).fill(0);
  p[0] = 2 / (right + left);
  p[5] = 2 / (up + down);
  p[8] = (right - left) / (right + left);
  p[9] = (up - down) / (up + down);
  p[10] = -(far + near) / (far - near);
  p[11] = -1;
  p[14] = (-2 * far * near) / (far - near);
  return p;
}

let projected = 0, outside = 0, heading = 0, widest = 0;
for (let k = 0; k < 300; k++) {
  const yaw = random(-3, 3), pitch = random(-1.2, 1.2), roll = k % 2 ? random(-0.5, 0.5) : 0;
  const middle = [random(-9, 9), random(0, 3), random(-9, 9)], head = axesOf(yaw, pitch, roll);
  if (!roll) {
    const own = headingOf(head);
    heading = Math.max(heading, Math.abs(own.yaw - yaw), Math.abs(own.pitch - pitch));
  }
  const eyes = [-1, 1].map((side) => ({
    place: middle.map((x, n) => x + 0.032 * side * head[0][n]),
    // Canted displays.
    axes: axesOf(yaw + (k % 3 ? 0 : 0.08 * side), pitch, roll),
    projection: projectionOf(random(0.6, 1.4), random(0.6, 1.4), random(0.6, 1.3), random(0.6, 1.3), 0.1, 50),
    lines: 1000,
  }));
  const own = headingOf(head), union = unionOf(eyes, { eye: middle, ...own });
  const { eye, planes } = frustumOf(union.pose, union.tall, union.aspect);
  widest = Math.max(widest, Math.hypot(...eye.map((x, n) => x - middle[n])));
  for (const one of eyes) {
    const { turn, lens, eye: place } = cameraOfEye(one), p = one.projection;
    for (let n = 0; n < 20; n++) {
      // A point in view, by the matrices of WebXR.
      const [u, v, far] = [random(-1, 1), random(-1, 1), random(0.1, 40)];
      const local = [(far * (u + p[8])) / p[0], (far * (v + p[9])) / p[5], -far];
      const at = place.map((x, m) => x + dot(local, one.axes.map((axis) => axis[m])));
      const off = at.map((x, m) => x - place[m]);
      const seen = [0, 1, 2].map((m) => turn[m] * off[0] + turn[3 + m] * off[1] + turn[6 + m] * off[2]);
      const clip = [seen[0] * lens[0], seen[1] * lens[1], seen[2] * lens[2] + lens[3], -seen[2]];
      const depth = (p[10] * -far + p[14]) / far;
      projected = Math.max(projected, Math.abs(clip[0] / clip[3] - u), Math.abs(clip[1] / clip[3] - v),
        Math.abs(clip[2] / clip[3] - depth));
      for (let m = 0; m < planes.length; m += 3) {
        outside += dot(at.map((x, i) => x - eye[i]), planes.slice(m, m + 3)) < -1e-9;
      }
    }
  }
}
console.log(JSON.stringify({ projected, outside, heading, widest }));
