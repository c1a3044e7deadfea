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
 * @property {string} tone "neutral" or "plain"
 * @property {number[]} [sky] radiance of the background, with "neutral"
 * @property {number[]} [ground]
 */
/** @typedef {{value: number}} Exposure a uniform */

/** Seconds in which the exposure nearly reaches another one, and a share of it that does not show. */
const EASE = 0.2, UNSEEN = 0.01;

/** Linear light that a screen can show. @param {string} tone */
const developed = (tone) => `
vec3 developed(vec3 light) {
  float most = max(light.r, max(light.g, light.b));
  if (most > ${tone === "plain" ? "1e30" : "0.8"}) {
    float peak = 1.0 - 0.04 / (most - 0.6);
    light = mix(light * (peak / most), vec3(peak), 1.0 - 1.0 / (0.15 * (most - peak) + 1.0));
  }
  return min(light, 1.0);
}
`;

/**
 * Shows a material in its light, after what `relief.js` has changed.
 * @param {import("three").MeshBasicMaterial} material whose colours of vertices, or `lightMap`, are shares of it
 * @param {number} white the light of which they are
 * @param {Light} light
 * @param {Exposure} exposure
 */
export function illuminate(material, white, { stops, tone }, exposure) {
  const before = material.onBeforeCompile, key = material.customProgramCacheKey();
  material.toneMapped = false;
  material.onBeforeCompile = (shader) => {
    before(shader);
    Object.assign(shader.uniforms, { white: { value: white }, exposure });
    const head = `uniform float white;\nuniform float exposure;\n${developed(tone)}`;
    const codes = "exp2(float(" + stops + ") * (lightMapTexel.rgb - 1.0))";
    shader.fragmentShader = head + shader.fragmentShader
      .replace("#include <aomap_fragment>", `
#ifdef USE_LIGHTMAP
reflectedLight.indirectDiffuse = ${codes};
#endif`)
      .replace("#include <opaque_fragment>", `$&
gl_FragColor.rgb = developed(gl_FragColor.rgb * white * exposure);`);
  };
  material.customProgramCacheKey = () => `${key} light ${stops} ${tone}`;
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
uniform float exposure;
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
 * @param {number} target
 * @param {number} seconds since the last time
 */
export function ease(exposure, target, seconds) {
  const still = globalThis.matchMedia?.("(prefers-reduced-motion: reduce)").matches;
  const ratio = still ? 1 : (exposure.value / target) ** Math.exp(-seconds / EASE);
  exposure.value = Math.abs(Math.log(ratio)) < UNSEEN ? target : target * ratio;
}
