/// \file
/// Several pictures on one, row by row.
#pragma once

#include <vector>

#include "nodes/observer/caption.hpp"
#include "render/scene/image.hpp"

namespace afterglow::nodes {

/// A sheet of pictures; each becomes as wide as a cell, `kCell` px, and has its caption below.
class ContactSheet {
 public:
  static constexpr int kCell = 640, kColumns = 3, kGap = 8;  ///< pixels

  /// Pictures of one moment, one above the other; all moments have as many of the same sizes.
  void add(const std::vector<render::Image>& pictures, const Caption& caption);
  /// All of them, on gray.
  render::Image image() const;

 private:
  CaptionPainter painter_;
  std::vector<render::Image> cells_;
};

}  // namespace afterglow::nodes
