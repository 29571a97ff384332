// In place of projected_light.glsl where no projector's light can be.
vec3 thrownAt(ivec2 at, vec3 n_world) { return vec3(0.0); }

vec3 airAt(vec2 uv) { return vec3(0.0); }
