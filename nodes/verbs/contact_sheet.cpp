#include "nodes/verbs/contact_sheet.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace afterglow::nodes {
namespace {

constexpr std::uint8_t kGround = 96;

render::Image blank(int width, int height) {
  const auto bytes = static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3;
  return {width, height, std::vector<std::uint8_t>(bytes, kGround)};
}

std::size_t placeOf(const render::Image& image, int x, int y) {
  return (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
          static_cast<std::size_t>(x)) *
         3;
}

void paste(const render::Image& image, int left, int top, render::Image& onto) {
  for (int y = 0; y < image.height; ++y) {
    std::copy_n(image.rgb.begin() + static_cast<std::ptrdiff_t>(placeOf(image, 0, y)),
                image.width * 3,
                onto.rgb.begin() + static_cast<std::ptrdiff_t>(placeOf(onto, left, top + y)));
  }
}

}  // namespace

render::Image ofWidth(const render::Image& image, int width) {
  const std::int64_t proportional = std::int64_t{image.height} * width / image.width;
  const int height = std::max(1, static_cast<int>(proportional));
  render::Image small = blank(width, height);
  const auto part = [](int i, int of, int whole) {
    return static_cast<int>(std::int64_t{i} * whole / of);
  };
  for (int y = 0; y < height; ++y) {
    const int top = part(y, height, image.height);
    const int bottom = std::max(top + 1, part(y + 1, height, image.height));
    for (int x = 0; x < width; ++x) {
      const int left = part(x, width, image.width);
      const int right = std::max(left + 1, part(x + 1, width, image.width));
      std::size_t sums[3] = {0, 0, 0};
      for (int row = top; row < bottom; ++row) {
        for (int column = left; column < right; ++column) {
          const std::size_t from = placeOf(image, column, row);
          for (std::size_t i = 0; i < 3; ++i) sums[i] += image.rgb[from + i];
        }
      }
      const auto count = static_cast<std::size_t>((bottom - top) * (right - left));
      const std::size_t to = placeOf(small, x, y);
      for (std::size_t i = 0; i < 3; ++i) {
        small.rgb[to + i] = static_cast<std::uint8_t>(sums[i] / count);
      }
    }
  }
  return small;
}

void ContactSheet::add(const std::vector<render::Image>& pictures, const Caption& caption) {
  std::vector<render::Image> parts;
  int height = 0;
  for (const render::Image& picture : pictures) {
    parts.push_back(ofWidth(picture, kCell));
    height += parts.back().height;
  }
  render::Image cell = blank(kCell, height);
  int top = 0;
  for (const render::Image& part : parts) {
    paste(part, 0, top, cell);
    top += part.height;
  }
  cells_.push_back(painter_.withStrip(cell, caption));
}

render::Image ContactSheet::image() const {
  if (cells_.empty()) return {};
  const int rows = (static_cast<int>(cells_.size()) + kColumns - 1) / kColumns;
  const int columns = std::min(kColumns, static_cast<int>(cells_.size()));
  const int height = cells_.front().height;
  render::Image sheet = blank(columns * (kCell + kGap) + kGap, rows * (height + kGap) + kGap);
  for (int i = 0; i < static_cast<int>(cells_.size()); ++i) {
    paste(cells_[static_cast<std::size_t>(i)], kGap + i % kColumns * (kCell + kGap),
          kGap + i / kColumns * (height + kGap), sheet);
  }
  return sheet;
}

}  // namespace afterglow::nodes
