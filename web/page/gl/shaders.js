// The programs. Positions are taken relative to the eye before any multiplication, and the view only
// rotates them, so that scenes far from the origin lose no digits.

/** The vertex shader, with further declarations and statements. @param {string} [declared]
 * @param {string} [stated] */
export const corners = (declared = "", stated = "") => `#version 300 es
precision highp float;
uniform vec3 eye;
uniform mat3 turn;
uniform vec4 lens; // 1/tan across, 1/tan up, and of depth: scale, offset
layout(location = 0) in vec3 position;
layout(location = 1) in vec2 place;
layout(location = 2) in vec4 paint;
out vec3 seen;
out vec2 uv;
out vec3 painted;${declared}
void main() {
  ${stated}
  painted = paint.rgb;
  seen = turn * (position - eye);
  uv = place;
  gl_Position = vec4(seen.xy * lens.xy, seen.z * lens.z + lens.w, -seen.z);
}`;

/** The texel of a surface; one or two channels are grey, the second is alpha. */
export const TEXEL = `
uniform sampler2D map;
uniform vec3 cut; // least alpha, or 0; texels across the finest level, twice for each that fades in; samples of a pixel
uniform int channels; // 0: no level is present
uniform vec4 color;
uniform vec3 mean;
uniform bool textured;
vec4 texel() {
  vec4 sampled = texture(map, uv);
  if (channels == 1) sampled = vec4(sampled.rrr, 1.0);
  if (channels == 2) sampled = sampled.rrrg;
  return channels == 0 ? vec4(mean, 1.0) : sampled;
}`;

/**
 * Texels of the finest level are drawn or not, by their alpha; that of coarser ones is the share of these that are
 * drawn (docs/formats/hints.md#alpha): so many samples of the pixel, of which noise rounds the number. The noise
 * (Jimenez 2014, interleaved gradient) changes with the distance, lest a surface hide the same samples of the next.
 */
export const CUT = `
  if (cut.x > 0.0) {
    vec2 size = vec2(textureSize(map, 0));
    float wide = max(length(dFdx(uv) * size), length(dFdy(uv) * size));
    float detail = min(1.0, log2(cut.y / size.x * max(1.0, wide)));
    float noise = fract(53.0 * fract(dot(vec3(gl_FragCoord.xy, seen.z), vec3(0.0671, 0.00584, 0.03))));
    shown.a = floor(mix(step(cut.x, shown.a), shown.a, detail) * cut.z + noise) / cut.z;
  }
  if (shown.a < 0.004) discard;`;

/**
 * Surfaces with a texture are unlit, as in VRML browsers; the rest glow a little and are lit from the eye. Colours
 * multiply as they are encoded. `Light` changes this one, and others with the same expressions.
 */
const SURFACE = `#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec3 painted;
out vec4 shown;
${TEXEL}
void main() {
  vec4 sampled = texel();
  float light = 1.0;
  if (!textured) {
    sampled = vec4(1.0);
    float glow = 0.25;
    vec3 normal = cross(dFdx(seen), dFdy(seen));
    float size = length(normal);
    light = glow + (1.0 - glow) * (size > 0.0 ? abs(dot(normal, normalize(seen))) / size : 1.0);
  }
  shown = vec4(sampled.rgb * color.rgb * painted * light, sampled.a * color.a);${CUT}
}`;

/** Numbers of 16 bits in two channels of 8. */
const BYTES = `
vec2 bytes(float number) {
  float high = floor(number / 256.0);
  return vec2(number - 256.0 * high, high) / 255.0;
}`;

/**
 * The item buffer: pair + 1, and the level of detail in 1/256, where the finest level has 0.
 * u / w and 1 / w are linear across the screen, so their differences give exact derivatives however
 * large a pixel is.
 */
const ITEM = `#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
uniform float item;
uniform vec2 size; // texels of the finest level
uniform float pixels; // of the screen, for one of the item buffer
out vec4 shown;
${BYTES}
void main() {
  float w = gl_FragCoord.w;
  vec2 texels = uv * size;
  vec2 across = (dFdx(texels * w) - texels * dFdx(w)) / w;
  vec2 up = (dFdy(texels * w) - texels * dFdy(w)) / w;
  float most = max(dot(across, across), dot(up, up));
  float detail = 0.5 * log2(max(most, 1e-30)) - log2(pixels);
  shown = vec4(bytes(item), bytes(floor(256.0 * clamp(detail, 0.0, 31.0))));
}`;

/** A placeholder: the cell + 1. */
const PLACEHOLDER = `#version 300 es
precision highp float;
uniform float item;
layout(location = 1) out vec4 shown;
${BYTES}
void main() { shown = vec4(bytes(item), 0.0, 1.0); }`;

/** The shaders of each program. */
export const SURFACES = [corners(), SURFACE], ITEMS = [corners(), ITEM], PLACEHOLDERS = [corners(), PLACEHOLDER];
