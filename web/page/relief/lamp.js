// The light on relief, as `ptm render --lit` has it.

/** Share of ambient light, and the direction of the lamp. */
const AMBIENT = 0.3, LAMP = [0.5, 0.7, 0.6].map((x) => x / Math.hypot(0.5, 0.7, 0.6));

/** The light on a unit normal, in GLSL. */
export const LIT = `
float lit(vec3 normal) {
  float along = (1.0 + dot(normal, vec3(${LAMP.join()}))) / 2.0;
  return ${AMBIENT} + ${1 - AMBIENT} * along * along;
}`;
