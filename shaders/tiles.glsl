// Points of a list on the image, and the tiles of the image that each touches: at most four, which
// are as large as a point at least.
struct SeenPoint {
  vec2 center;  // window coordinates
  uint key;     // the farther the less
  uint color;   // 8 bits each, r lowest; 0: not seen
};
struct Tile {
  uint count, begin, next;  // of tile_items
};
layout(std430, binding = 2) buffer SeenPoints { SeenPoint seen_points[]; };
layout(std430, binding = 3) buffer Tiles {
  uint item_count;
  Tile tiles[];
};
layout(std430, binding = 4) coherent buffer TileItems { uvec2 tile_items[]; };  // key, point

uniform ivec2 tile_count;  // columns, rows
uniform int tile_px;
uniform float size_px;     // of a point

// Floats sort like their bits, but for the sign.
uint keyOf(float depth) {
  uint bits = floatBitsToUint(depth);
  return bits >> 31 != 0u ? bits : ~(bits | 0x80000000u);
}
float depthOf(uint key) { return uintBitsToFloat(key >> 31 != 0u ? key : ~key & 0x7fffffffu); }
