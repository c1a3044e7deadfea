// Surfaces with a cutoff, as docs/formats/hints.md#alpha specifies them, with one sample for a pixel.
//
// Tried: alpha to coverage, with which three.js lets what is behind the canvas show through.

const DECLARED = "uniform float finest; // texels across the finest level, 0 if unknown\n";
const CUT = `
vec2 size = vec2(textureSize(map, 0));
float wide = max(length(dFdx(vMapUv) * size), length(dFdy(vMapUv) * size));
float detail = min(1.0, log2(max(1.0, finest / size.x) * max(1.0, wide)));
float noise = fract(53.0 * fract(dot(vec3(gl_FragCoord.xy, 1.0 / gl_FragCoord.w), vec3(0.0671, 0.00584, 0.03))));
if (mix(step(alphaTest, diffuseColor.a), diffuseColor.a, detail) <= noise) discard;
`;

/**
 * Draws the share of coarse levels that a cutoff leaves, after what other modules have changed.
 * @param {import("three").MeshBasicMaterial} material with `alphaTest` and a map
 * @param {import("three").Texture & {finest?: number}} map see `PtmTexture`
 */
export function cut(material, map) {
  const before = material.onBeforeCompile, key = material.customProgramCacheKey();
  material.onBeforeCompile = (shader) => {
    before(shader);
    shader.uniforms.finest = { value: map.finest ?? 0 };
    shader.fragmentShader = DECLARED + shader.fragmentShader.replace("#include <alphatest_fragment>", CUT);
  };
  material.customProgramCacheKey = () => `${key} cut`;
}
