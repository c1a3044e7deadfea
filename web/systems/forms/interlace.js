// The page of an interlaced image: its files are joined as far as the view needs.
//
//     ?all    joins all files, whatever the view needs

import { programOf } from "../../page/gl/program.js";
import { find, inBytes } from "../../page/ui/elements.js";
import { indexOf, runForm } from "../../page/forms/form.js";
import { checkedSet, Joining } from "./joining.js";
import { Panning } from "./panning.js";
import { form } from "../../page/words/english.js";
import { fill } from "../../page/words/language.js";

const VERTEX = `#version 300 es
uniform vec4 box;
out vec2 place;
void main() {
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
  place = vec2(corner.x, 1.0 - corner.y);
  gl_Position = vec4(mix(box.xy, box.zw, corner), 0, 1);
}`;

/** Below a texel per pixel the mean of the texels in a pixel, at most 8 × 8. */
const FRAGMENT = `#version 300 es
precision highp float;
uniform sampler2D image;
in vec2 place;
out vec4 shown;
void main() {
  vec2 size = vec2(textureSize(image, 0));
  vec2 step = vec2(dFdx(place.x), dFdy(place.y));
  vec2 each = clamp(ceil(abs(step) * size), 1.0, 8.0);
  vec4 sum = vec4(0);
  for (float y = 0.5; y < each.y; y++)
    for (float x = 0.5; x < each.x; x++) {
      vec4 texel = texture(image, place + (vec2(x, y) / each - 0.5) * step);
      sum += vec4(texel.rgb * texel.a, texel.a);
    }
  sum /= each.x * each.y;
  shown = vec4(sum.rgb + (1.0 - sum.a) * vec3(0.227, 0.243, 0.275), 1);
}`;

runForm(async (gl, config, fetcher, fail) => {
  const address = new URL(config.index, location.href).href;
  const urlOf = (/** @type {string} */ file) => new URL(file, address).href;
  const index = await indexOf(fetcher, address, checkedSet);
  const joining = new Joining(gl, index, urlOf, fetcher);
  // Sides are powers of two; the picture has the ratio of its source.
  const { width, height } = index.original, canvas = /** @type {HTMLCanvasElement} */ (gl.canvas);
  const panning = new Panning(canvas, width, height), all = new URLSearchParams(location.search).has("all");
  const { program, at } = programOf(gl, "picture", [VERTEX, FRAGMENT]), array = gl.createVertexArray();
  const total = index.files.reduce((sum, { bytes }) => sum + bytes, 0);
  find(document, "#keys").textContent = form.pan;
  let needed = true, drawn = "";
  const draw = () => {
    gl.viewport(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight);
    gl.clearColor(0.086, 0.09, 0.106, 1);
    gl.clear(gl.COLOR_BUFFER_BIT);
    if (joining.texture) {
      gl.useProgram(program);
      gl.bindVertexArray(array);
      gl.activeTexture(gl.TEXTURE0);
      gl.bindTexture(gl.TEXTURE_2D, joining.texture);
      gl.uniform1i(at.image, 0);
      gl.uniform4fv(at.box, panning.box);
      gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    }
  };
  return {
    frame(dt) {
      panning.step(dt);
      // A further file is needed while a texel is larger than a pixel.
      const { size } = joining;
      needed = all || !joining.steps || size.width < panning.pixels * width || size.height < panning.pixels * height;
      if (needed) joining.advance(fail);
      const picture = [canvas.width, canvas.height, ...panning.box, joining.steps].join();
      if (picture !== drawn) draw();
      drawn = picture;
      const there = index.files.slice(0, joining.steps).reduce((sum, { bytes }) => sum + bytes, 0);
      const end = joining.steps === index.files.length ? "" :
        joining.steps === joining.most ? `; ${form.tooLarge}` :
        needed ? " …" : `; ${form.zoom}`;
      const part = fill(form.files, {
        count: joining.steps, total: index.files.length, size: `${size.width} × ${size.height}`,
        whole: `${index.width} × ${index.height}`, bytes: inBytes(there), all: inBytes(total),
      });
      const depth = index.kind === "uint16" ? `; ${form.eightBits}` : "";
      return `${part}${end}${depth}`;
    },
    state: () => ({
      steps: joining.steps,
      size: joining.size,
      pixels: panning.pixels,
      shift: panning.shift,
      complete: joining.steps === joining.most,
      needed,
      pending: fetcher.pending,
      requests: fetcher.requests,
      bytes: fetcher.bytes,
    }),
    texels: () => joining.texels(),
    place: panning.place.bind(panning),
  };
});
