// A list of things alike, in the GPU's memory, and its way to the optical frame. Needs lens.glsl.
layout(std430, binding = 0) readonly buffer ListPoints { float list_points[]; };  // x, y, z of each
layout(std430, binding = 1) readonly buffer ListColors { uint list_colors[]; };   // r lowest

uniform vec3 list_origin;     // what follows is of differences to it
uniform mat4 P_optical_list;  // homogeneous
uniform vec4 list_height;     // over the surface = list_height . (difference, 1)
uniform bool list_is_flattened;
uniform bool list_has_colors;
uniform vec4 list_tint;       // multiplies the colors
uniform vec4 list_color;      // without them

const float kNear = 0.02;  // as LensDomain has it

vec3 listPoint(uint i) {
  uint k = 3u * i;
  return vec3(list_points[k], list_points[k + 1u], list_points[k + 2u]) - list_origin;
}

vec4 listColor(uint i) {
  return list_has_colors ? min(list_tint * unpackUnorm4x8(list_colors[i]), 1.0) : list_color;
}

// As LightVertex::depth; q is homogeneous.
float listDepth(vec3 p, vec4 q) {
  float height = dot(list_height, vec4(p, 1.0));
  return list_is_flattened ? -height / (1.0 + abs(height)) : 1.0 - 2.0 * kNear * q.w / q.z;
}

// Whether the lens shows what reaches so far around there. What is not finite: no.
bool isSeen(vec4 q, float reach, float reach_w) {
  float nearest = q.z - reach;
  return q.w > reach_w && nearest >= kNear * q.w && nearest < 1e18 &&
         length(q.xy) + reach <= lens_fold * nearest;
}
