// Puts a list's points into the lists of the tiles that they touch, in three steps. Needs
// lens.glsl, list.glsl and tiles.glsl.
layout(local_size_x = 256) in;

uniform int step_number;
uniform int list_count;

void forTiles(uint point, bool is_counting) {
  vec2 center = seen_points[point].center;
  ivec2 low = max(ivec2(floor((center - 0.5 * size_px) / float(tile_px))), 0);
  ivec2 high = min(ivec2(floor((center + 0.5 * size_px) / float(tile_px))), tile_count - 1);
  for (int y = low.y; y <= high.y; ++y) {
    for (int x = low.x; x <= high.x; ++x) {
      int tile = y * tile_count.x + x;
      if (is_counting) {
        atomicAdd(tiles[tile].count, 1u);
      } else {
        tile_items[atomicAdd(tiles[tile].next, 1u)] = uvec2(seen_points[point].key, point);
      }
    }
  }
}

void see(uint i) {
  vec3 p = listPoint(i);
  vec4 q = P_optical_list * vec4(p, 1.0);
  uint color = packUnorm4x8(listColor(i));
  bool is_seen = isSeen(q, 0.0, 0.0) && color >> 24 != 0u;
  vec2 center = windowFromPixel(lensPixel(q.xyz));
  seen_points[i] = SeenPoint(center, keyOf(listDepth(p, q)), is_seen ? color : 0u);
}

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (step_number == 1) {
    if (i >= uint(tile_count.x * tile_count.y)) return;
    tiles[i].begin = tiles[i].next = atomicAdd(item_count, tiles[i].count);
    return;
  }
  if (i >= uint(list_count)) return;
  if (step_number == 0) see(i);
  if (seen_points[i].color != 0u) forTiles(i, step_number == 0);
}
