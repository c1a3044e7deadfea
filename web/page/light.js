// The script of sites with light: it shows surfaces in linear light, exposed for the viewer's cell, and sky and
// ground around the building (docs/formats/hints.md#colours).

/** Seconds in which the exposure nearly reaches that of another cell, metres of a frame that are a jump, and a
 * share of the exposure that does not show. */
const EASE = 0.2, JUMP = 1, UNSEEN = 0.01;

/** Linear light of colours as sRGB encodes them (IEC 61966-2-1), here and below to 0.1 of 255: powers would double
 * the time of a picture without a graphics card. */
const LINEAR = `
vec3 linear(vec3 color) {
  vec3 curve = color * (color * (color * (color * -0.11677 + 0.52647) + 0.5604) + 0.0284) + 0.00105;
  return mix(curve, color / 12.92, lessThanEqual(color, vec3(0.04045)));
}`;

/**
 * The colour of linear light on the screen. From a knee on, the curve is Khronos PBR Neutral without its offset,
 * which makes up for reflections.
 * @param {string} [knee]
 */
const developed = (knee = "0.8") => `
vec3 developed(vec3 light) {
  float most = max(light.r, max(light.g, light.b));
  if (most > ${knee}) {
    float peak = 1.0 - 0.04 / (most - 0.6);
    light = mix(light * (peak / most), vec3(peak), 1.0 - 1.0 / (0.15 * (most - peak) + 1.0));
  }
  light = min(light, 1.0);
  vec3 root = sqrt(light), curve = 0.29812 * sqrt(root) + 0.83374 * root - 0.05531 * light - 0.07691;
  return mix(curve, 12.92 * light, lessThanEqual(light, vec3(0.0031308)));
}`;

/** Of vertices: their colours are linear before they are interpolated. */
const CORNERS = `
layout(location = 3) in vec2 place2;
out vec2 spot;
uniform float white;
void main() {
  spot = place2;`;

/** @param {import("./data/site.js").LightRow} row */
const fragments = ({ stops, tone }) => `
in vec2 spot;
uniform float white; // exposed; 0 of unlit surfaces
uniform sampler2D lightmap;
uniform vec3 code; // 1 of light at vertices; until the lightmap arrives, its mean; negative with it
${LINEAR}
${developed(tone === "plain" ? "1e30" : undefined)}
vec3 display(vec3 texel) {
  if (white == 0.0) return texel * color.rgb * painted;
  vec3 share = code.r < 0.0 ? texture(lightmap, spot).rgb : code;
  return developed(linear(texel) * color.rgb * painted * white * exp2(float(${stops}) * (share - 1.0)));
}
void main`;

/** A triangle behind everything, and the direction of each of its points. */
const BEHIND = `#version 300 es
precision highp float;
uniform mat3 turn;
uniform vec4 lens;
out vec3 way;
void main() {
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0;
  way = inverse(turn) * vec3(corner / lens.xy, -1.0);
  gl_Position = vec4(corner, 1.0, 1.0);
}`;
const SURROUNDINGS = `#version 300 es
precision highp float;
in vec3 way;
uniform vec3 sky;
uniform vec3 ground;
out vec4 shown;
${developed()}
void main() {
  shown = vec4(developed(mix(ground, sky, smoothstep(-0.02, 0.02, normalize(way).y))), 1.0);
}`;

/** @typedef {import("./gl/renderer.js").Renderer} Renderer */
/** @typedef {import("./walkthrough.js").Walkthrough} Walkthrough */
/** @typedef {import("./gl/program.js").Program} Program */

export class Light {
  exposure = 1;
  /** Where the viewer was, and when, s. @type {number[]} */
  #eye = [];
  #before = 0;
  /** Whether the viewer has come by a jump to a cell that is still to be known. */
  #jumped = true;
  /** Draws the surroundings. @type {Program | null} */
  #surroundings = null;

  /** @param {import("./data/site.js").LightRow} row */
  constructor(row) {
    this.row = row;
  }

  /**
   * The shaders of surfaces in this light; others stay as they are.
   * @param {string[]} sources
   */
  sources([corners, fragment]) {
    if (!fragment.includes("painted")) return [corners, fragment];
    const lit = fragment.replace(/sampled\.rgb ?\* ?color\.rgb ?\* ?painted/, "display(sampled.rgb)");
    return [
      corners.replace(/void main\(\) ?{/, CORNERS)
        .replace(/painted ?= ?paint\.rgb/, "painted = white > 0.0 ? pow(paint.rgb, vec3(4.0)) : paint.rgb"),
      lit.replace("void main", fragments(this.row)).replace(/glow ?= ?0\.25/, "glow = white > 0.0 ? 1.0 : 0.7"),
    ];
  }

  /** Lets a renderer show surfaces in it. @param {Renderer} renderer */
  illuminate(renderer) {
    renderer.light = this;
    renderer.gl.deleteProgram(renderer.surface.program);
    renderer.surface = renderer.compile("surface");
  }

  /**
   * Eases the exposure to that of the viewer's cell.
   * @param {Walkthrough} walk
   * @param {number[]} eye
   * @param {number} now s
   */
  adapt({ cell, client: { known }, index: { cells }, memory: { fades }, picture }, eye, now) {
    const { exposure, row: { tone } } = this;
    const target = cell < 0 || tone === "plain" ? exposure : cells[cell].exposure ?? 1;
    this.#jumped ||= !(Math.hypot(...eye.map((x, k) => x - this.#eye[k])) < JUMP);
    const ratio = this.#jumped || !fades ? 1 : (exposure / target) ** Math.exp((this.#before - now) / EASE);
    this.exposure = Math.abs(Math.log(ratio)) < UNSEEN ? target : target * ratio;
    this.#jumped &&= !known[cell];
    this.#before = now;
    this.#eye = [...eye];
    if (this.exposure !== exposure) picture.touch();
  }

  /**
   * Sets the uniforms of the light on a look; whether a level of the lightmap fades in.
   * @param {Renderer} renderer
   * @param {Program["at"]} at
   * @param {import("./data/glb.js").Shape} look
   * @param {number} now s
   */
  paint({ gl, memory, means }, at, { white, light }, now) {
    gl.uniform1f(at.white, white * this.exposure);
    const map = light < 0 ? null : memory.of(light);
    gl.uniform3fv(at.code, map ? [-1, -1, -1] : means[light] ?? [1, 1, 1]);
    if (!map) return false;
    gl.activeTexture(gl.TEXTURE1);
    const fading = map.bind(true, true, now);
    gl.activeTexture(gl.TEXTURE0);
    gl.uniform1i(at.lightmap, 1);
    return fading;
  }

  /**
   * Draws sky and ground where there is nothing yet.
   * @param {Renderer} renderer
   * @param {import("./gl/camera.js").Camera} camera
   */
  surround(renderer, { turn, lens }) {
    const { gl, surface } = renderer, { row: { tone, sky = [], ground = [] }, exposure } = this;
    if (tone === "plain") return;
    const { program, at } = (this.#surroundings ??= renderer.compile("surroundings", [BEHIND, SURROUNDINGS]));
    gl.useProgram(program);
    gl.uniformMatrix3fv(at.turn, false, turn);
    gl.uniform4fv(at.lens, lens);
    gl.uniform3fv(at.sky, sky.map((part) => part * exposure));
    gl.uniform3fv(at.ground, ground.map((part) => part * exposure));
    gl.bindVertexArray(null);
    gl.depthFunc(gl.LEQUAL);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.depthFunc(gl.LESS);
    gl.useProgram(surface.program);
  }
}

/**
 * Lets the renderer show surfaces in the light.
 * @param {Walkthrough} walk
 */
export function show({ comparison, index, picture: { renderer } }) {
  if (!index.light) return;
  const light = new Light(index.light);
  light.illuminate(renderer);
  if (comparison) light.illuminate(comparison.renderer);
}
