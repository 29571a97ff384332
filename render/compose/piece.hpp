/// \file
/// Steps as a back end has expanded them, put into the order of drawing.
#pragma once

#include <cstdint>
#include <vector>

namespace afterglow::render {

/// A step as the back end draws it.
struct Piece {
  enum class Kind {
    Triangles,  ///< of a translucent piece each pixel takes the nearest only
    Outlines,   ///< the same
    Points,     ///< blended by how much of each pixel they cover, farthest first
  };
  Kind kind;
  bool is_opaque;              ///< points: never
  std::uint32_t first, count;  ///< of the back end's list of that kind
  double mean_depth;           ///< as LightVertex::depth
};

struct ExpandedLayer {
  int mask = -1;           ///< as ComposedLayer has it
  bool flattened = false;  ///< as Placed has it
  std::vector<Piece> pieces;
};

/// Opaque pieces in any order, neighboring triangles as one; then the others, farthest first.
void sortForDrawing(std::vector<Piece>& pieces);

}  // namespace afterglow::render
