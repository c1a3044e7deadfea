// Light as docs/formats/hints.md#colours specifies it: surfaces in linear light, exposed for the viewer's cell and
// compressed by the tone curve, and what is around the building.
//
// Tried: the tone mapping of three.js. Its neutral one begins with an offset that makes up for reflections, and it
// would also change what is not lit.

import { BufferAttribute, BufferGeometry, Mesh, ShaderMaterial } from "three";

/**
 * The light of a building.
 * @typedef {object} Light
 * @property {number} stops powers of two that the codes of lightmaps cover
 * @property {number} [hue] the multiple of the hue of codes that lightmaps have
 * @property {string} tone "neutral", "agx" or "plain"
 * @property {number[]} [sky] radiance of the background, with "neutral"
 * @property {number[]} [ground]
 */
/** @typedef {{value: number[]}} Exposure a uniform: factors of red, green and blue */
/**
 * A panorama of light, as seen from a point of a cell.
 * @typedef {{white: number, mean: number, centre: number[], low: number[], high: number[]}} Probe
 */
/**
 * What a material reflects.
 * @typedef {object} Mirrored
 * @property {Probe} probe
 * @property {import("./ptm-texture.js").PtmTexture} texture
 * @property {number[]} color its mean code, of 255
 * @property {number} levels of the texture: only the finest is of use
 * @property {number} metallic
 * @property {number} roughness
 */

/** Seconds in which the exposure nearly reaches another one, and a share of it that does not show. */
const EASE = 0.2, UNSEEN = 0.01;

/** The tone curves, Khronos PBR Neutral without its offset and AgX (docs/formats/hints.md#colours). @type {Record<string, string>} */
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

/** Linear light that a screen can show. @param {string} tone */
const developed = (tone) => `
vec3 developed(vec3 light) {${CURVES[tone] ?? CURVES.neutral}
  return clamp(light, 0.0, 1.0);
}
`;

/** What a surface reflects: Karis' split sum, with an analytic second part, and a probe mirrored in its box. */
const reflections = (/** @type {number} */ stops) => `
varying vec3 bent; // 0 if flat
varying vec3 away;
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
  return power.x * exp2(float(${stops}) * (share - 1.0));
}
void meet() {
  vec3 facing = dot(bent, bent) > 0.0 ? bent : cross(dFdx(away), dFdy(away));
  vec3 ray = normalize(away);
  facing *= inversesqrt(max(dot(facing, facing), 1e-36));
  way = reflect(ray, facing);
  vec3 at = cameraPosition + away, ends = max((high - at) / way, (low - at) / way);
  way = at + way * max(0.0, min(ends.x, min(ends.y, ends.z))) - centre;
  vec4 k = polish.y * vec4(-1.0, -0.0275, -0.572, 0.022) + vec4(1.0, 0.0425, 1.04, -0.04);
  float share = min(k.x * k.x, exp2(-9.28 * max(abs(dot(facing, ray)), 0.001))) * k.x + k.y;
  part = vec2(-1.04, 1.04) * share + k.zw;
}
vec3 reflected(vec3 base, vec3 light) {
  meet();
  vec3 share = mix(vec3(0.04), base, polish.x) * part.x + part.y, image = seenAlong(way, polish.y);
  image *= mix(1.0, min(1.0, dot(light, vec3(0.2126, 0.7152, 0.0722)) / power.y), polish.y);
  image = mix(image, light, smoothstep(0.2, 0.8, polish.y)) * share;
  return base * light * (1.0 - polish.x) * (1.0 - max(share.r, max(share.g, share.b))) + image;
}
`;
/** Glass hides of what is behind it what it reflects, which is estimated by what is seen along the ray. */
const GLASS = `
meet();
float mirrored = 0.04 * part.x + part.y;
mirrored *= 1.9 - 0.9 * mirrored;
vec3 behind = seenAlong(away, 1.0) * exposure;
vec3 both = encoded(behind * (1.0 - mirrored) + seenAlong(way, polish.y) * mirrored * exposure);
gl_FragColor.rgb *= gl_FragColor.a * (1.0 - mirrored);
gl_FragColor.rgb += max(both - (1.0 - mirrored) * encoded(behind), 0.0);
gl_FragColor.a += mirrored * (1.0 - gl_FragColor.a);
`;
const ENCODED = `
vec3 encoded(vec3 light) {
  return linearToOutputTexel(vec4(developed(light), 1.0)).rgb;
}
`;

/**
 * Lets a shader know its way from the camera, and what it reflects.
 * @param {{uniforms: Record<string, {value: unknown}>, vertexShader: string}} shader
 * @param {Mirrored} mirrored
 */
function mirror(shader, { probe: { white, mean, centre, low, high }, texture, color, levels, metallic, roughness }) {
  const code = color.map((part) => part / 255), here = [-1, -1, -1];
  const haze = {
    get value() {
      return texture.level + 1 < levels ? code : here;
    },
  };
  const values = { centre, low, high, polish: [metallic, roughness], power: [white, Math.max(mean, 1e-30)], probe: texture };
  Object.assign(shader.uniforms, { haze });
  for (const [name, value] of Object.entries(values)) shader.uniforms[name] = { value };
  shader.vertexShader = `varying vec3 bent;\nvarying vec3 away;\n` + shader.vertexShader
    .replace("#include <project_vertex>", `$&
bent = normal;
away = (vec4(mvPosition.xyz, 0.0) * viewMatrix).xyz;`);
}

/**
 * Shows what glass reflects. Its colour comes multiplied by its opacity, which that does not have.
 * @param {import("three").MeshBasicMaterial} material
 * @param {Light} light
 * @param {Exposure} exposure
 * @param {Mirrored} mirrored
 */
export function glaze(material, { stops, tone }, exposure, mirrored) {
  material.premultipliedAlpha = true;
  material.toneMapped = false;
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, { exposure });
    mirror(shader, mirrored);
    const head = `uniform vec3 exposure;\n${developed(tone)}${ENCODED}${reflections(stops)}`;
    shader.fragmentShader = head + shader.fragmentShader.replace("#include <premultiplied_alpha_fragment>", GLASS);
  };
  material.customProgramCacheKey = () => `glass ${stops} ${tone}`;
}

/**
 * Shows a material in its light, after what `relief.js` has changed.
 * @param {import("three").MeshBasicMaterial} material whose colours of vertices, or `lightMap`, are shares of it
 * @param {number} white the light of which they are
 * @param {Light} light
 * @param {Exposure} exposure
 * @param {Mirrored | null} [mirrored] what it reflects
 */
export function illuminate(material, white, { stops, hue = 1, tone }, exposure, mirrored) {
  const before = material.onBeforeCompile, key = material.customProgramCacheKey();
  material.toneMapped = false;
  material.onBeforeCompile = (shader) => {
    before(shader);
    Object.assign(shader.uniforms, { white: { value: white }, exposure });
    if (mirrored) mirror(shader, mirrored);
    const shown = mirrored ? "reflected(diffuseColor.rgb, received * white)" : "gl_FragColor.rgb * white";
    const head = `uniform float white;\nuniform vec3 exposure;\n${developed(tone)}${mirrored ? reflections(stops) : ""}`;
    const even = `mix(vec3(dot(lightMapTexel.rgb, vec3(0.299, 0.587, 0.114))), lightMapTexel.rgb, 1.0 / float(${hue}))`;
    const codes = `exp2(float(${stops}) * (${even} - 1.0))`;
    shader.fragmentShader = head + shader.fragmentShader
      .replace("#include <aomap_fragment>", `
vec3 received = vec3(1.0);
#ifdef USE_LIGHTMAP
received = ${codes};
reflectedLight.indirectDiffuse = received;
#endif`)
      .replace("#include <opaque_fragment>", `$&
gl_FragColor.rgb = developed(${shown} * exposure);`);
  };
  material.customProgramCacheKey = () => `${key} light ${stops} ${hue} ${tone} ${Boolean(mirrored)}`;
}

/**
 * Sky and ground, to be added to a scene, where nothing else is; null if the light has none.
 * @param {Light} light
 * @param {Exposure} exposure
 */
export function surroundingsOf({ tone, sky, ground }, exposure) {
  if (tone === "plain" || !sky || !ground) return null;
  const material = new ShaderMaterial({
    depthWrite: false,
    toneMapped: false,
    uniforms: { sky: { value: sky }, ground: { value: ground }, exposure },
    vertexShader: `
varying vec3 way;
void main() {
  vec4 far = inverse(projectionMatrix) * vec4(position.xy, 1.0, 1.0);
  way = (vec4(far.xyz / far.w, 0.0) * viewMatrix).xyz;
  gl_Position = vec4(position.xy, 1.0, 1.0);
}`,
    fragmentShader: `
varying vec3 way;
uniform vec3 sky;
uniform vec3 ground;
uniform vec3 exposure;
${developed(tone)}
void main() {
  float share = smoothstep(-0.02, 0.02, normalize(way).y);
  gl_FragColor = vec4(developed(mix(ground, sky, share) * exposure), 1.0);
  #include <colorspace_fragment>
}`,
  });
  const corners = new Float32Array([-1, -1, 0, 3, -1, 0, -1, 3, 0]);
  const geometry = new BufferGeometry().setAttribute("position", new BufferAttribute(corners, 3));
  // After opaque surfaces, which hide most of it.
  return Object.assign(new Mesh(geometry, material), { frustumCulled: false, renderOrder: 1 });
}

/**
 * Eases an exposure to another one, or sets it at once for visitors who ask for less motion.
 * @param {Exposure} exposure
 * @param {number[]} target
 * @param {number} seconds since the last time
 */
export function ease(exposure, target, seconds) {
  const still = globalThis.matchMedia?.("(prefers-reduced-motion: reduce)").matches;
  const left = still ? 0 : Math.exp(-seconds / EASE);
  const ratios = target.map((part, k) => (exposure.value[k] / part) ** left);
  const seen = ratios.some((ratio) => Math.abs(Math.log(ratio)) > UNSEEN);
  exposure.value = seen ? target.map((part, k) => part * ratios[k]) : target;
}
