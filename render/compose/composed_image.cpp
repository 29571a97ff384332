#include "render/compose/composed_image.hpp"

#include <algorithm>
#include <cstddef>

namespace afterglow::render {

void sortForDrawing(std::vector<Piece>& pieces) {
  std::stable_sort(pieces.begin(), pieces.end(), [](const Piece& a, const Piece& b) {
    if (a.is_opaque != b.is_opaque) return a.is_opaque;
    return a.is_opaque ? a.kind < b.kind : a.mean_depth > b.mean_depth;
  });
  std::size_t used = 0;
  for (const Piece& piece : pieces) {
    Piece* last = used > 0 ? &pieces[used - 1] : nullptr;
    if (last != nullptr && last->is_opaque && piece.is_opaque && last->kind == piece.kind &&
        last->first + last->count == piece.first) {
      last->count += piece.count;
    } else {
      pieces[used++] = piece;
    }
  }
  pieces.resize(used);
}

}  // namespace afterglow::render
