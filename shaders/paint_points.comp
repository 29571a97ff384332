// The light of points, tile by tile: a square of size_px pixels around each center gives each pixel
// the share that it covers, so that the centroid is exact at every size and position. The nearest
// comes first, until nothing behind is seen. Either over what is painted already, or by itself,
// four samples a pixel, for points.frag to lay over what is drawn. Needs tiles.glsl.
layout(local_size_x = 16, local_size_y = 16) in;
layout(std430, binding = 5) buffer Painted { uint painted[]; };  // times alpha; by sample

const uint kMostNear = 1024u;
shared uvec2 near_items[kMostNear];  // a tile's items, if they are so few

uniform ivec2 image_size;
uniform bool is_first;  // nothing is painted yet, and what painted has does not count
uniform int sample_count;
uniform sampler2DMS depths;  // what may be before the points, where there are several samples

bool isAfter(uvec2 a, uvec2 b) { return a.x > b.x || (a.x == b.x && a.y > b.y); }

bool isNear(Tile tile) { return tile.count <= kMostNear; }
uvec2 itemAt(Tile tile, uint i) {
  return isNear(tile) ? near_items[i] : tile_items[tile.begin + i];
}
void setItem(Tile tile, uint i, uvec2 item) {
  if (isNear(tile)) {
    near_items[i] = item;
  } else {
    tile_items[tile.begin + i] = item;
  }
}

// Bitonic: of two sorted runs the elements that face each other are compared first.
void sortItems(Tile tile) {
  uint count = tile.count;
  if (isNear(tile)) {
    for (uint i = gl_LocalInvocationIndex; i < count; i += 256u) {
      near_items[i] = tile_items[tile.begin + i];
    }
    barrier();
  }
  for (uint run = 2u; run < 2u * count; run *= 2u) {
    for (uint gap = run / 2u; gap > 0u; gap /= 2u) {
      for (uint pair = gl_LocalInvocationIndex;; pair += 256u) {
        uint i = 2u * pair - pair % gap, k = gap == run / 2u ? i ^ (run - 1u) : i + gap;
        if (i >= count) break;
        if (k >= count) continue;
        uvec2 a = itemAt(tile, i), b = itemAt(tile, k);
        if (!isAfter(a, b)) continue;
        setItem(tile, i, b);
        setItem(tile, k, a);
      }
      memoryBarrierBuffer();
      barrier();
    }
  }
}

float shareOf(vec2 offset) {
  vec2 half_size = vec2(0.5 * size_px);
  vec2 covered = max(min(offset + half_size, 0.5) - max(offset - half_size, -0.5), 0.0);
  return covered.x * covered.y;
}

void paint(ivec2 at, Tile tile) {
  const float kNothing = 1.0 / 1024.0;
  float depth[4] = float[](1.0, 1.0, 1.0, 1.0), through[4] = depth;
  vec3 light[4] = vec3[](vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
  if (sample_count > 1) {
    for (int s = 0; s < 4; ++s) depth[s] = 2.0 * texelFetch(depths, at, s).r - 1.0;
  }
  float most = 1.0;
  for (uint k = tile.count; k > 0u && most > kNothing; --k) {
    uvec2 item = itemAt(tile, k - 1u);
    SeenPoint point = seen_points[item.y];
    float share = shareOf(point.center - (vec2(at) + 0.5)), z = depthOf(item.x);
    if (share <= 0.0) continue;
    vec4 color = unpackUnorm4x8(point.color);
    most = 0.0;
    for (int s = 0; s < sample_count; ++s) {
      float alpha = z <= depth[s] ? share * color.a : 0.0;
      light[s] += through[s] * alpha * color.rgb;
      through[s] *= 1.0 - alpha;
      most = max(most, through[s]);
    }
  }
  int first = sample_count * (at.y * image_size.x + at.x);
  if (sample_count == 1) {
    if (!is_first) light[0] += through[0] * unpackUnorm4x8(painted[first]).rgb;
    through[0] = 0.0;
  }
  for (int s = 0; s < sample_count; ++s) {
    painted[first + s] = packUnorm4x8(vec4(light[s], 1.0 - through[s]));
  }
}

void main() {
  Tile tile = tiles[gl_WorkGroupID.y * uint(tile_count.x) + gl_WorkGroupID.x];
  if (tile.count == 0u && sample_count == 1 && !is_first) return;
  sortItems(tile);
  ivec2 first = tile_px * ivec2(gl_WorkGroupID.xy) + ivec2(gl_LocalInvocationID.xy);
  for (int y = 0; y < tile_px; y += 16) {
    for (int x = 0; x < tile_px; x += 16) {
      ivec2 at = first + ivec2(x, y);
      if (all(lessThan(at, image_size))) paint(at, tile);
    }
  }
}
