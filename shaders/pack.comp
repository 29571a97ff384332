// An image's samples, or its painted pixels, as the bytes that the CPU wants: r, g, b, row by row.
// Four pixels are three words.
layout(local_size_x = 256) in;
layout(std430, binding = 0) writeonly buffer Rgb { uint words[]; };
layout(std430, binding = 5) readonly buffer Painted { uint painted[]; };

uniform sampler2DMS samples;
uniform ivec2 image_size;
uniform bool is_painted;

uvec3 pixel(uint i) {
  if (is_painted) return uvec3(painted[i], painted[i] >> 8, painted[i] >> 16) & 255u;
  ivec2 at = ivec2(i % uint(image_size.x), i / uint(image_size.x));
  vec3 sum = vec3(0.0);
  for (int k = 0; k < 4; ++k) sum += texelFetch(samples, at, k).rgb;
  return uvec3(255.0 / 4.0 * sum + 0.5);
}

void main() {
  uint i = gl_GlobalInvocationID.x, last = uint(image_size.x * image_size.y) - 1u;
  if (4u * i > last) return;
  uvec3 a = pixel(4u * i), b = pixel(min(4u * i + 1u, last)), c = pixel(min(4u * i + 2u, last)),
        d = pixel(min(4u * i + 3u, last));
  words[3u * i] = a.r | a.g << 8 | a.b << 16 | b.r << 24;
  words[3u * i + 1u] = b.g | b.b << 8 | c.r << 16 | c.g << 24;
  words[3u * i + 2u] = c.b | d.r << 8 | d.g << 16 | d.b << 24;
}
