// The relief of objects with normal maps (docs/formats/apo.md): lit by a lamp, as the viewer of `ptm serve`
// lights them.

/** Share of ambient light, and the direction of the lamp. */
const AMBIENT = 0.3, LAMP = [0.5, 0.7, 0.6].map((x) => x / Math.hypot(0.5, 0.7, 0.6));

const VERTEX = `attribute vec2 uv1;
attribute vec4 tangent;
varying vec2 place;
varying mat3 axes;
`;
const PLACED = `
place = uv1;
axes = mat3(tangent.xyz, tangent.w * cross(normal, tangent.xyz), normal);
`;
const FRAGMENT = `uniform sampler2D relief;
varying vec2 place;
varying mat3 axes;
`;
const LIT = `
vec3 facing = normalize(axes * (texture2D(relief, place).rgb * 2.0 - 1.0));
float along = (1.0 + dot(facing, vec3(${LAMP.join()}))) / 2.0;
gl_FragColor.rgb *= ${AMBIENT} + ${1 - AMBIENT} * along * along;
`;

/**
 * Lights a material by a normal map. Colours are multiplied as they are encoded.
 * @param {import("three").MeshBasicMaterial} material
 * @param {import("three").Texture} map
 */
export function relieve(material, map) {
  material.onBeforeCompile = (shader) => {
    shader.uniforms.relief = { value: map };
    shader.vertexShader = VERTEX + after(shader.vertexShader, "#include <begin_vertex>", PLACED);
    shader.fragmentShader = FRAGMENT + after(shader.fragmentShader, "#include <colorspace_fragment>", LIT);
  };
}

/** @param {string} shader @param {string} place @param {string} more */
const after = (shader, place, more) => shader.replace(place, place + more);
