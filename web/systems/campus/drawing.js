// Draws a campus: the shader of a material follows from the channels that exist (docs/formats/campus.md,
// "Drawing").

import { isCard } from "../../page/gl/context.js";
import { aim, programOf } from "../../page/gl/program.js";
import { corners } from "../../page/gl/shaders.js";
import { textureFile } from "./index.js";

/** The sky. */
const SKY = [0.66, 0.78, 0.9];

const VERTEX = corners(`
layout(location = 3) in vec2 spot;
out vec2 lit;`, "lit = spot;");

/** @param {string[]} channels of d, a, l */
const fragment = (channels) => `#version 300 es
precision highp float;
in vec2 uv, lit;
in vec3 painted;
uniform sampler2D d, a, l;
uniform vec4 color;
uniform float cutoff;
uniform bool blends;
out vec4 shown;
vec3 encoded(vec3 c) {
  return mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
}
void main() {
  vec3 light = color.rgb * painted;
  float opacity = color.a;
  ${channels.includes("d") ? "light *= texture(d, uv).rgb;" : ""}
  ${channels.includes("l") ? "light *= texture(l, lit).rgb;" : ""}
  ${channels.includes("a") ? "opacity *= texture(a, uv).r;" : ""}
  if (opacity < max(cutoff, 0.004)) discard;
  shown = vec4(encoded(min(light, 1.0)), blends ? opacity : 1.0);
}`;

/** @param {number} value of an sRGB channel, to linear light */
const linear = (value) => (value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4);

/** @typedef {{object: number, mesh: string, lightmap: string | null, far: number}} Shown an object with its
 *   mesh, the texture of its light, and its distance */

export class CampusDrawing {
  /** By their channels. @type {Map<string, import("../../page/gl/program.js").Program>} */
  #programs = new Map();
  /** By their wrap modes. @type {Map<string, WebGLSampler>} */
  #samplers = new Map();

  /** @param {WebGL2RenderingContext} gl @param {import("./index.js").CampusIndex} index
   * @param {import("./files.js").CampusFiles} files */
  constructor(gl, index, files) {
    this.gl = gl;
    this.index = index;
    this.files = files;
    // As in walks: with software it costs more than it shows.
    this.anisotropy = isCard(gl) && gl.getExtension("EXT_texture_filter_anisotropic");
  }

  /**
   * @param {import("../../page/gl/camera.js").Camera} camera
   * @param {Shown[]} shown
   * @param {(base: string, channel: string) => string | null} textureOf the file in use, if any
   */
  draw(camera, shown, textureOf) {
    const { gl } = this;
    gl.viewport(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight);
    gl.clearColor(SKY[0], SKY[1], SKY[2], 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    const parts = shown.flatMap((one) =>
      (this.files.mesh(one.mesh)?.parts ?? []).map((each) => ({ ...one, ...each })));
    const blends = (/** @type {typeof parts[0]} */ { part }) => this.index.materials[part.material].alpha === "blend";
    for (const behind of [false, true]) {
      (behind ? gl.enable : gl.disable).call(gl, gl.BLEND);
      gl.depthMask(!behind);
      const some = parts.filter((each) => blends(each) === behind);
      if (behind) some.sort((a, b) => b.far - a.far);
      for (const each of some) this.#part(camera, each, textureOf);
    }
    gl.depthMask(true);
    gl.bindVertexArray(null);
  }

  /** @param {import("../../page/gl/camera.js").Camera} camera
   * @param {Shown & {part: import("./files.js").Part, array: WebGLVertexArrayObject, count: number, type: number}} one
   * @param {(base: string, channel: string) => string | null} textureOf */
  #part(camera, { part, array, count, type, lightmap }, textureOf) {
    const { gl } = this, material = this.index.materials[part.material], { base, wrap } = material;
    /** @type {Record<string, string | null>} */
    const files = { d: null, a: null, l: part.spots && lightmap };
    if (base && part.uvs) {
      for (const channel of ["d", "a"]) {
        if (material.channels.includes(channel)) files[channel] = textureOf(base, channel);
      }
    }
    const present = Object.keys(files).filter((channel) => files[channel] && this.files.texture(/** @type {string} */ (files[channel])));
    const key = present.join("");
    let program = this.#programs.get(key);
    if (!program) {
      program = programOf(gl, `campus ${key}`, [VERTEX, fragment(present)]);
      this.#programs.set(key, program);
    }
    const { at } = program;
    aim(gl, program, camera);
    present.forEach((channel, unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, this.files.texture(/** @type {string} */ (files[channel]))?.texture ?? null);
      gl.bindSampler(unit, this.#sampler(channel === "l" ? ["clamp", "clamp"] : wrap));
      gl.uniform1i(at[channel], unit);
    });
    gl.uniform4fv(at.color, [...material.color.map(linear), material.opacity]);
    gl.uniform1f(at.cutoff, material.alpha === "mask" ? material.cutoff ?? 0 : 0);
    gl.uniform1i(at.blends, Number(material.alpha === "blend"));
    (material.twoSided ? gl.disable : gl.enable).call(gl, gl.CULL_FACE);
    gl.bindVertexArray(array);
    gl.drawElements(gl.TRIANGLES, count, type, 0);
  }

  /** @param {string[]} wrap */
  #sampler(wrap) {
    const { gl, anisotropy } = this, key = wrap.join();
    const known = this.#samplers.get(key);
    if (known) return known;
    const sampler = gl.createSampler();
    gl.samplerParameteri(sampler, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
    gl.samplerParameteri(sampler, gl.TEXTURE_MAG_FILTER, gl.LINEAR);
    [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T].forEach((axis, k) =>
      gl.samplerParameteri(sampler, axis, wrap[k] === "clamp" ? gl.CLAMP_TO_EDGE : gl.REPEAT));
    if (anisotropy) gl.samplerParameterf(sampler, anisotropy.TEXTURE_MAX_ANISOTROPY_EXT, 4);
    this.#samplers.set(key, sampler);
    return sampler;
  }
}

/** The finest texture of a base that is there, up to a size. @param {Set<string>} loaded @param {string} base
 * @param {string} channel @param {number[]} sizes descending */
export function finest(loaded, base, channel, sizes) {
  for (const size of sizes) {
    const file = textureFile(base, size, channel);
    if (loaded.has(file)) return file;
  }
  return null;
}
