#include "render/gl/lit_mask.hpp"

#include <algorithm>
#include <cmath>

namespace afterglow::render {

LitMask::LitMask(const calib::Lens& lens)
    : columns_((lens.width + kBlock - 1) / kBlock), rows_((lens.height + kBlock - 1) / kBlock) {
  const LensDomain domain(lens);
  const Eigen::Array2d size = (domain.max() - domain.min()).array();
  const Eigen::Array2i last(kWidth - 1, kHeight - 1);
  // Rays through the blocks' corners, half a pixel outside of their first pixels' centers.
  std::vector<std::optional<Eigen::Vector3d>> rays;
  for (int row = 0; row <= rows_; ++row) {
    for (int column = 0; column <= columns_; ++column) {
      rays.push_back(calib::unproject(lens, {column * kBlock - 0.5, row * kBlock - 0.5}));
    }
  }
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column) {
      Cells cells{last, -Eigen::Array2i::Ones()};
      for (int corner = 0; corner < 4; ++corner) {
        const int index = (row + corner / 2) * (columns_ + 1) + column + corner % 2;
        const auto& ray = rays[static_cast<std::size_t>(index)];
        if (!ray) continue;
        const Eigen::Array2d at = (ray->head<2>() - domain.min()).array() / size;
        const Eigen::Array2i cell = (at * Eigen::Array2d(kWidth, kHeight)).floor().cast<int>();
        // One more on each side: for a block's bulge, and for bilinear look-ups beside it.
        cells.low = cells.low.min(cell - 1).max(0);
        cells.high = cells.high.max(cell + 1).min(last);
      }
      cells_of_.push_back(cells);
    }
  }
}

bool LitMask::isLit(const Image& image, int column, int row) const {
  const int u = column * kBlock, width = std::min(kBlock, image.width - u);
  const int v_end = std::min((row + 1) * kBlock, image.height);
  for (int v = row * kBlock; v < v_end; ++v) {
    const std::uint8_t* pixels =
        &image.rgb[3 * (static_cast<std::size_t>(v) * static_cast<std::size_t>(image.width) +
                        static_cast<std::size_t>(u))];
    unsigned any = 0;
    for (int i = 0; i < 3 * width; ++i) any |= pixels[i];
    if (any != 0) return true;
  }
  return false;
}

const std::vector<std::uint8_t>& LitMask::mark(const Image& image) {
  mask_.assign(static_cast<std::size_t>(kWidth) * kHeight, 0);
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column) {
      if (!isLit(image, column, row)) continue;
      const Cells& cells = cells_of_[static_cast<std::size_t>(row * columns_ + column)];
      for (int y = cells.low.y(); y <= cells.high.y(); ++y) {
        const auto begin = mask_.begin() + y * kWidth;
        if (cells.low.x() <= cells.high.x()) {
          std::fill(begin + cells.low.x(), begin + cells.high.x() + 1, std::uint8_t{255});
        }
      }
    }
  }
  return mask_;
}

}  // namespace afterglow::render
