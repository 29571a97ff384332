// A picture blurred in one direction, as bright light is in an eye.
uniform sampler2D picture;
uniform ivec2 along;

out vec4 blurred;

const int kReach = 9;  // texels

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy), last = textureSize(picture, 0) - 1;
  vec3 sum = vec3(0.0);
  float weights = 0.0;
  for (int i = -kReach; i <= kReach; ++i) {
    float weight = exp(-0.045 * float(i * i));
    sum += weight * texelFetch(picture, clamp(at + i * along, ivec2(0), last), 0).rgb;
    weights += weight;
  }
  blurred = vec4(sum / weights, 1.0);
}
