/// \file
/// Roughly where a projected image is not black, as the room meets it before the lens: a cheap
/// look-up that spares most of the room the costly one.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "calib/lens.hpp"
#include "render/scene/image.hpp"
#include "render/scene/lens_domain.hpp"

namespace afterglow::render {

class LitMask {
 public:
  static constexpr int kWidth = 128, kHeight = 80;  ///< cells

  explicit LitMask(const calib::Lens& lens);

  /// Cells of ShadowMap::clipFromOptical's square, rows from y = -1 up: 255 where light may be.
  /// The image's size must be the lens's. Valid until the next call.
  const std::vector<std::uint8_t>& mark(const Image& image);

 private:
  static constexpr int kBlock = 16;  // px
  struct Cells {
    Eigen::Array2i low, high;  ///< empty where high < low: no ray reaches the block
  };
  bool isLit(const Image& image, int column, int row) const;

  int columns_, rows_;
  std::vector<Cells> cells_of_;  ///< by block of the image
  std::vector<std::uint8_t> mask_;
};

}  // namespace afterglow::render
