#include "render/compose/composed_image.hpp"

#include <algorithm>
#include <cstddef>

namespace afterglow::render {

namespace {

bool isSame(const Eye& a, const Eye& b) {
  return a.R_world_eye == b.R_world_eye && a.p_world == b.p_world && a.parallel == b.parallel &&
         a.letters_face_it == b.letters_face_it && a.reader == b.reader &&
         a.focal_px == b.focal_px && a.p_lens == b.p_lens;
}

}  // namespace

bool isSamePlace(const ComposedLayer& a, const ComposedLayer& b) {
  return a.relief == b.relief && a.mask == b.mask &&
         a.placed.P_optical_world == b.placed.P_optical_world &&
         a.placed.height == b.placed.height && a.placed.flattened == b.placed.flattened &&
         a.placed.gain == b.placed.gain && isSame(a.eye, b.eye);
}

bool isSame(const std::vector<ComposedMask>& a, const std::vector<ComposedMask>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& x, const auto& y) {
    return x.outline == y.outline && x.shades == y.shades;
  });
}

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
