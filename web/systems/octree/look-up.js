// The traversal of an octree texture in a fragment shader (docs/formats/apo.md, "Looking a normal up";
// Lacoste et al., section 3.2).

import { WIDTH } from "./octree.js";

/** Declares the uniforms of an octree, `stopDepth` of a place in its cube, and `addressAt`. */
export const LOOK_UP = `
uniform usampler2D octree;
uniform int texels, deepest;
uniform bool partial;

uvec4 texel(usampler2D of, int address) {
  return texelFetch(of, ivec2(address % ${WIDTH}, address / ${WIDTH}), 0);
}

int ones(uint mask) {
  mask -= mask >> 1u & 0x55u;
  mask = (mask & 0x33u) + (mask >> 2u & 0x33u);
  return int((mask + (mask >> 4u)) & 0x0fu);
}

// The address of the texel whose normal is shown at a place of the cube. A level that is there in part is
// black where it is not.
int addressAt(vec3 at, int stop) {
  at = clamp(at, 0.0, 0.99999994);
  int address = 0;
  uvec4 here = texel(octree, 0);
  stop = min(stop, deepest + int(partial));
  for (int depth = 0; here.a != 0u && depth < stop && address + 1 < texels; depth++) {
    at *= 2.0;
    bvec3 upper = greaterThanEqual(at, vec3(1.0));
    at -= vec3(upper);
    uint bit = 1u << (uint(upper.x) + 2u * uint(upper.y) + 4u * uint(upper.z));
    if ((here.a & bit) == 0u) break;
    uvec4 below = texel(octree, address + 1);
    int next = int(below.r | below.g << 8u | below.b << 16u);
    next += ones(here.a & (bit - 1u)) + ones(below.a & (bit - 1u));
    if (next >= texels) break;
    uvec4 there = texel(octree, next);
    if (partial && depth == deepest && there.rgb == uvec3(0u)) break;
    address = next;
    here = there;
  }
  return address;
}

// The depth at which nodes become smaller than the fragment. The exponent of D² is floor(log2 D²), so half
// of it, rounded down, is floor(log2 D).
int stopDepth(vec3 at) {
  vec3 dx = dFdx(at), dy = dFdy(at);
  return -((floatBitsToInt(min(dot(dx, dx), dot(dy, dy))) >> 23) - 127 >> 1);
}`;
