// Compiles programs and looks up their uniforms.

/**
 * @typedef {object} Program
 * @property {WebGLProgram} program
 * @property {Record<string, WebGLUniformLocation | null>} at of each uniform
 */

/**
 * @param {WebGL2RenderingContext} gl
 * @param {string} name
 * @param {string[]} sources of the shaders
 * @returns {Program}
 */
export function programOf(gl, name, sources) {
  const program = gl.createProgram();
  const kinds = [gl.VERTEX_SHADER, gl.FRAGMENT_SHADER];
  sources.forEach((source, k) => {
    const shader = /** @type {WebGLShader} */ (gl.createShader(kinds[k]));
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
    gl.deleteShader(shader);
  });
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
    throw new Error(`${name}: ${gl.getProgramInfoLog(program)}`);
  }
  /** @type {Program["at"]} */
  const at = {};
  const count = gl.isContextLost() ? 0 : gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS);
  for (let k = 0; k < count; k++) {
    const name = gl.getActiveUniform(program, k)?.name ?? "";
    at[name] = gl.getUniformLocation(program, name);
  }
  return { program, at };
}

/**
 * Sets the uniforms of the vertex shader.
 * @param {WebGL2RenderingContext} gl
 * @param {Program} use
 * @param {import("./camera.js").Camera} camera
 */
export function aim(gl, { program, at }, camera) {
  gl.useProgram(program);
  gl.uniform3fv(at.eye, camera.eye);
  gl.uniformMatrix3fv(at.turn, false, camera.turn);
  gl.uniform4fv(at.lens, camera.lens);
}
