#include "render/compose/composed_image.hpp"

#include <algorithm>
#include <cstddef>

namespace afterglow::render {

void sortForDrawing(std::vector<Piece>& pieces) {
  std::stable_sort(pieces.begin(), pieces.end(), [](const Piece& a, const Piece& b) {
    if (a.is_opaque || b.is_opaque) return a.is_opaque && !b.is_opaque;
    return a.mean_depth > b.mean_depth;
  });
  std::size_t used = 0;
  const auto isSolid = [](const Piece& piece) {
    return piece.is_opaque && piece.kind == Piece::Kind::Triangles;
  };
  for (const Piece& piece : pieces) {
    Piece* last = used > 0 ? &pieces[used - 1] : nullptr;
    if (last != nullptr && isSolid(*last) && isSolid(piece) &&
        last->first + last->count == piece.first) {
      last->count += piece.count;
    } else {
      pieces[used++] = piece;
    }
  }
  pieces.resize(used);
}

}  // namespace afterglow::render
