// The script of sites with light: it shows surfaces in linear light, exposed for the viewer's cell, what they
// reflect, and sky and ground around the building (docs/formats/hints.md#colours).

/** Seconds in which the exposure nearly reaches that of another cell, metres of a frame that are a jump, a share
 * of the exposure that does not show, and the usual exposure. */
const EASE = 0.2, JUMP = 1, UNSEEN = 0.01, USUAL = [1, 1, 1];

/** Linear light of colours as sRGB encodes them (IEC 61966-2-1), here and below to 0.1 of 255: powers would double
 * the time of a picture without a graphics card. */
const LINEAR = `
vec3 linear(vec3 color) {
  vec3 curve = color * (color * (color * (color * -0.11677 + 0.52647) + 0.5604) + 0.0284) + 0.00105;
  return mix(curve, color / 12.92, lessThanEqual(color, vec3(0.04045)));
}`;

/** The tone curves: Khronos PBR Neutral without its offset, which makes up for reflections; AgX. */
const CURVES = {
  plain: "",
  neutral: `
  float most = max(light.r, max(light.g, light.b));
  if (most > 0.8) {
    float peak = 1.0 - 0.04 / (most - 0.6);
    light = mix(light * (peak / most), vec3(peak), 1.0 - 1.0 / (0.15 * (most - peak) + 1.0));
  }`,
  agx: `
  light *= mat3(0.544815, 0.373787, 0.081384, 0.140417, 0.754152, 0.105431, 0.088811, 0.178876, 0.732313);
  vec3 y = clamp(log2(max(light, 1e-9)) / 16.5 + 0.755995, 0.0, 1.0);
  light = (((((15.5 * y - 40.14) * y + 31.96) * y - 6.868) * y + 0.4298) * y + 0.1191) * y - 0.00232;
  light *= mat3(1.127101, -0.110607, -0.016494, -0.14133, 1.157824, -0.016494, -0.14133, -0.110607, 1.251936);
  light = pow(max(light, 0.0), vec3(2.2));
  light *= mat3(1.660491, -0.587641, -0.07285, -0.12455, 1.1329, -0.008349, -0.018151, -0.100579, 1.11873);`,
};

/** The colour of linear light on the screen. @param {import("./data/site.js").LightRow["tone"]} tone */
const developed = (tone) => `
vec3 developed(vec3 light) {${CURVES[tone] ?? CURVES.neutral}
  light = clamp(light, 0.0, 1.0);
  vec3 root = sqrt(light), curve = 0.29812 * sqrt(root) + 0.83374 * root - 0.05531 * light - 0.07691;
  return mix(curve, 12.92 * light, lessThanEqual(light, vec3(0.0031308)));
}`;

/** Of vertices: their colours are linear before they are interpolated. @param {boolean} reflects */
const cornersOf = (reflects) => `
layout(location = 3) in vec2 place2;
out vec2 spot;
uniform float white;${reflects ? `
layout(location = 5) in vec3 normal;
out vec3 bent;
out vec3 away;` : ""}
void main() {
  spot = place2;${reflects ? `
  bent = normal;
  away = position - eye;` : ""}`;

/** What a surface reflects: Karis' split sum, with an analytic second part, and a probe mirrored in its box. */
const REFLECTIONS = `
in vec3 bent; // 0 if flat
in vec3 away;
uniform vec3 eye;
uniform vec3 centre;
uniform vec3 low;
uniform vec3 high;
uniform vec2 polish; // metallic, roughness
uniform vec2 power; // of the greatest code, on average
uniform sampler2D probe;
uniform vec3 haze; // until the probe arrives, the mean of its codes; negative with it
vec3 way;
vec2 part; // of what is reflected: factor of the colour, and a share of white
vec3 stored(vec2 place, float level) {
  vec2 corner = vec2(level < 1.0 ? 0.0 : level < 3.0 ? 128.0 : 160.0, level < 2.0 ? 0.0 : 64.0);
  return textureLod(probe, (corner + 1.0 + place * (exp2(7.0 - level) - 2.0)) / vec2(192.0, 128.0), 0.0).rgb;
}
vec3 seenAlong(vec3 ray, float rough) {
  vec3 share = haze;
  if (share.r < 0.0) {
    ray /= abs(ray.x) + abs(ray.y) + abs(ray.z);
    vec2 place = ray.xz;
    if (ray.y < 0.0) place = (1.0 - abs(ray.zx)) * mix(vec2(-1.0), vec2(1.0), greaterThanEqual(place, vec2(0.0)));
    float level = min(floor(3.0 * rough), 2.0);
    place = place * 0.5 + 0.5;
    share = mix(stored(place, level), stored(place, level + 1.0), 3.0 * rough - level);
  }
  return power.x * exp2(stops * (share - 1.0));
}
void meet() {
  vec3 normal = dot(bent, bent) > 0.0 ? bent : cross(dFdx(away), dFdy(away));
  vec3 ray = normalize(away);
  normal *= inversesqrt(max(dot(normal, normal), 1e-36));
  way = reflect(ray, normal);
  vec3 at = eye + away, ends = max((high - at) / way, (low - at) / way);
  way = at + way * max(0.0, min(ends.x, min(ends.y, ends.z))) - centre;
  vec4 k = polish.y * vec4(-1.0, -0.0275, -0.572, 0.022) + vec4(1.0, 0.0425, 1.04, -0.04);
  float share = min(k.x * k.x, exp2(-9.28 * max(abs(dot(normal, ray)), 0.001))) * k.x + k.y;
  part = vec2(-1.04, 1.04) * share + k.zw;
}
vec3 reflected(vec3 base, vec3 light) {
  meet();
  vec3 share = mix(vec3(0.04), base, polish.x) * part.x + part.y, image = seenAlong(way, polish.y);
  image *= mix(1.0, min(1.0, dot(light, vec3(0.2126, 0.7152, 0.0722)) / power.y), polish.y);
  image = mix(image, light, smoothstep(0.2, 0.8, polish.y)) * share;
  return base * light * (1.0 - polish.x) * (1.0 - max(share.r, max(share.g, share.b))) + image;
}`;
/** Glass hides of what is behind it what it reflects, which is estimated by what is seen along the ray. */
const GLASS = `
  if (white == 0.0) {
    meet();
    float share = 0.04 * part.x + part.y;
    share *= 1.9 - 0.9 * share;
    vec3 behind = seenAlong(away, 1.0) * exposure;
    vec3 image = developed(behind * (1.0 - share) + seenAlong(way, polish.y) * share * exposure);
    shown.rgb *= shown.a * (1.0 - share);
    shown.rgb += max(image - (1.0 - share) * developed(behind), 0.0);
    shown.a += share * (1.0 - shown.a);
  }
  `;

/** @param {import("./data/site.js").LightRow} row @param {boolean} reflects */
const fragmentsOf = ({ stops, hue = 1, tone }, reflects) => `
const float stops = float(${stops});
in vec2 spot;
uniform float white; // 0 of unlit surfaces
uniform vec3 exposure;
uniform sampler2D lightmap;
uniform vec3 code; // 1 of light at vertices; until the lightmap arrives, its mean; negative with it
${LINEAR}
${developed(tone)}
${reflects ? REFLECTIONS : ""}
vec3 display(vec3 texel) {
  if (white == 0.0) return texel * color.rgb * painted;
  vec3 share = code.r < 0.0 ? texture(lightmap, spot).rgb : code;
  share = mix(vec3(dot(share, vec3(0.299, 0.587, 0.114))), share, 1.0 / float(${Math.max(1, hue) || 1}));
${reflects ? `  return developed(exposure * reflected(linear(texel) * color.rgb * painted, white * exp2(stops * (share - 1.0))));`
    : `  return developed(linear(texel) * color.rgb * painted * white * exposure * exp2(stops * (share - 1.0)));`}
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
/** @param {import("./data/site.js").LightRow["tone"]} tone */
const surroundingsIn = (tone) => `#version 300 es
precision highp float;
in vec3 way;
uniform vec3 sky;
uniform vec3 ground;
out vec4 shown;
${developed(tone)}
void main() {
  shown = vec4(developed(mix(ground, sky, smoothstep(-0.02, 0.02, normalize(way).y))), 1.0);
}`;

/** @typedef {import("./gl/renderer.js").Renderer} Renderer */
/** @typedef {import("./walkthrough.js").Walkthrough} Walkthrough */
/** @typedef {import("./gl/program.js").Program} Program */

export class Light {
  /** Factors of red, green and blue. */
  exposure = USUAL;
  /** Where the viewer was, and when, s. @type {number[]} */
  #eye = [];
  #before = 0;
  /** Whether the viewer has come by a jump to a cell that is still to be known. */
  #jumped = true;
  /** Draws the surroundings. @type {Program | null} */
  #surroundings = null;
  /** Draws what reflects. @type {Program | null} */
  #mirror = null;
  /** How metallic and how rough looks are. @type {WeakMap<import("./data/glb.js").Shape, number[]>} */
  #polish = new WeakMap();

  /**
   * @param {import("./data/site.js").LightRow} row
   * @param {import("./data/site.js").TextureRow[]} textures
   */
  constructor(row, textures) {
    this.row = row;
    /** Those of textures that are probes, and sound. */
    this.probes = textures.map(({ probe }) => {
      const { white, mean, centre, low, high } = /** @type {any} */ (probe ?? {});
      return [white, mean, ...[centre, low, high].flat()].every(Number.isFinite) ? probe : undefined;
    });
  }

  /**
   * The shaders of surfaces in this light; others stay as they are.
   * @param {string[]} sources
   * @param {boolean} [reflects]
   */
  sources([corners, fragment], reflects = false) {
    if (!fragment.includes("painted")) return [corners, fragment];
    const lit = fragment.replace(/sampled\.rgb ?\* ?color\.rgb ?\* ?painted/, "display(sampled.rgb)");
    return [
      corners.replace(/void main\(\) ?{/, cornersOf(reflects))
        .replace(/painted ?= ?paint\.rgb/, "painted = white > 0.0 ? pow(paint.rgb, vec3(4.0)) : paint.rgb"),
      lit.replace("void main", fragmentsOf(this.row, reflects)).replace(/if ?\(cut/, `${reflects ? GLASS : ""}$&`)
        .replace(/glow ?= ?0?\.25/, "glow = white > 0.0 ? 1.0 : 0.7"),
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
    const target = cell < 0 || tone === "plain" ? exposure : cells[cell].exposure ?? USUAL;
    this.#jumped ||= !(Math.hypot(...eye.map((x, k) => x - this.#eye[k])) < JUMP);
    const left = this.#jumped || !fades ? 0 : Math.exp((this.#before - now) / EASE);
    const ratios = target.map((part, k) => (exposure[k] / part) ** left);
    const seen = ratios.some((ratio) => Math.abs(Math.log(ratio)) > UNSEEN);
    this.exposure = seen ? target.map((part, k) => part * ratios[k]) : target;
    this.#jumped &&= !known[cell];
    this.#before = now;
    this.#eye = [...eye];
    if (this.exposure !== exposure) picture.touch();
  }

  /**
   * What draws a look that reflects, else null.
   * @param {Renderer} renderer
   * @param {import("./data/glb.js").Shape} look
   */
  mirrorOf(renderer, { probe }) {
    if (!this.probes[probe] || this.row.tone === "plain") return null;
    return (this.#mirror ??= renderer.compile("mirror", undefined, true));
  }

  /**
   * Sets the uniforms of the light on a look; whether a level of the lightmap fades in.
   * @param {Renderer} renderer
   * @param {Program["at"]} at
   * @param {import("./data/glb.js").Shape} look
   * @param {number} now s
   */
  paint({ gl, memory, means }, at, look, now) {
    const { white, light, probe, extras } = look;
    const { exposure, probes: { [probe]: mirrored } } = this;
    gl.uniform1f(at.white, white);
    gl.uniform3fv(at.exposure, exposure);
    /** Of codes: their mean, until levels are there. @type {(number: number, levels: number, mean: string, map: string, unit: number) => boolean} */
    const bind = (number, levels, mean, map, unit) => {
      const storage = number < 0 ? null : memory.of(number), there = storage && storage.levels >= levels;
      gl.uniform3fv(at[mean], there ? [-1, -1, -1] : means[number] ?? [1, 1, 1]);
      if (!there) return false;
      gl.activeTexture(gl.TEXTURE0 + unit);
      // A probe, whose other levels mix its parts, does not fade in.
      const fading = storage.bind(true, true, levels ? Infinity : now, true);
      if (levels) gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
      gl.activeTexture(gl.TEXTURE0);
      gl.uniform1i(at[map], unit);
      return fading;
    };
    if (mirrored && at.polish) {
      let polish = this.#polish.get(look);
      if (!polish) {
        const { metallicFactor = 0, roughnessFactor = 1 } = JSON.parse(extras);
        this.#polish.set(look, (polish = [metallicFactor, roughnessFactor]));
      }
      gl.uniform2fv(at.polish, polish);
      gl.uniform2f(at.power, mirrored.white, Math.max(mirrored.mean, 1e-30));
      for (const name of /** @type {const} */ (["centre", "low", "high"])) gl.uniform3fv(at[name], mirrored[name]);
      bind(probe, memory.rows[probe].sizes.length, "haze", "probe", 3);
    }
    return bind(light, 0, "code", "lightmap", 1);
  }

  /**
   * Draws sky and ground where there is nothing yet.
   * @param {Renderer} renderer
   * @param {import("./gl/camera.js").Camera} camera
   */
  surround(renderer, { turn, lens }) {
    const { gl } = renderer, { row: { tone, sky = [], ground = [] }, exposure } = this;
    if (tone === "plain") return;
    const { program, at } = (this.#surroundings ??= renderer.compile("surroundings", [BEHIND, surroundingsIn(tone)]));
    gl.useProgram(program);
    gl.uniformMatrix3fv(at.turn, false, turn);
    gl.uniform4fv(at.lens, lens);
    gl.uniform3fv(at.sky, sky.map((part, k) => part * exposure[k]));
    gl.uniform3fv(at.ground, ground.map((part, k) => part * exposure[k]));
    gl.bindVertexArray(null);
    gl.depthFunc(gl.LEQUAL);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.depthFunc(gl.LESS);
  }
}

/**
 * Lets the renderer show surfaces in the light.
 * @param {Walkthrough} walk
 */
export function show({ comparison, index, picture: { renderer } }) {
  if (!index.light) return;
  const light = new Light(index.light, index.textures);
  light.illuminate(renderer);
  if (comparison) light.illuminate(comparison.renderer);
}
