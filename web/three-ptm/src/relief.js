// The relief of normal maps, as the viewer of `ptm serve` shows it. Objects with a map of their own
// (docs/formats/apo.md) are lit by a lamp. The map of a material changes its colours by the share by which the
// light of that lamp on its normals differs from that on the face.

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
const LAMPLIGHT = `float lit(vec3 normal) {
  float along = (1.0 + dot(normal, vec3(${LAMP.join()}))) / 2.0;
  return ${AMBIENT} + ${1 - AMBIENT} * along * along;
}
`;
const LIT = `
vec3 facing = normalize(axes * (texture2D(relief, place).rgb * 2.0 - 1.0));
gl_FragColor.rgb *= lit(facing);
`;

/** The axes of the map follow from the derivatives, exactly: positions are linear in it. */
const BUMPY = `uniform sampler2D relief;
uniform float bumpiness;
varying vec2 place;
varying vec3 seen;
float bumps() {
  vec3 a = dFdx(seen), b = dFdy(seen);
  vec2 p = dFdx(place), q = dFdy(place);
  float side = sign(p.x * q.y - p.y * q.x);
  vec3 up = normalize(cross(a, b)), right = (a * q.y - b * p.y) * side, over = (a * q.x - b * p.x) * side;
  if (dot(right, right) == 0.0) return 1.0;
  vec3 tilt = texture2D(relief, place).rgb * 2.0 - 1.0;
  right = normalize(right);
  vec3 across = cross(up, right);
  if (dot(across, over) < 0.0) across = -across;
  vec3 normal = normalize(bumpiness * (right * tilt.x + across * tilt.y) + up * tilt.z);
  return lit((vec4(normal, 0.0) * viewMatrix).xyz) / lit((vec4(up, 0.0) * viewMatrix).xyz);
}
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
    shader.fragmentShader = LAMPLIGHT + FRAGMENT + after(shader.fragmentShader, "#include <colorspace_fragment>", LIT);
  };
}

/**
 * Changes the light on a material by its normal map.
 * @param {import("three").MeshBasicMaterial} material
 * @param {import("three").Texture} map
 * @param {number} scale factor of x and y of the normals
 * @param {number} coords number of the coordinates in the map
 */
export function bump(material, map, scale, coords) {
  const name = coords ? `uv${coords}` : "uv";
  const declared = `${coords ? `attribute vec2 ${name};\n` : ""}varying vec2 place;\nvarying vec3 seen;\n`;
  material.onBeforeCompile = (shader) => {
    shader.uniforms.relief = { value: map };
    shader.uniforms.bumpiness = { value: scale };
    const placed = `\nplace = ${name};\nseen = mvPosition.xyz;\n`;
    shader.vertexShader = declared + after(shader.vertexShader, "#include <project_vertex>", placed);
    const lit = "\ngl_FragColor.rgb *= bumps();\n";
    shader.fragmentShader = LAMPLIGHT + BUMPY + after(shader.fragmentShader, "#include <colorspace_fragment>", lit);
  };
  material.customProgramCacheKey = () => `bump ${coords}`;
}

/** @param {string} shader @param {string} place @param {string} more */
const after = (shader, place, more) => shader.replace(place, place + more);
