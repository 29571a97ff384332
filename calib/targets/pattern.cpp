#include "calib/targets/pattern.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "calib/picture.hpp"
#include "calib/targets/board.hpp"
#include "calib/targets/tag.hpp"

namespace afterglow::calib {
namespace {

/// Cells of the small tags across the image. With the usual camera, of about as many pixels as the
/// projector and a wider lens, a cell is then 3 camera pixels; AprilTag needs 2.
int cellPixels(int width) { return std::max(3, static_cast<int>(std::lround(width / 256.0))); }

Tag tagAt(int id, int left, int top, int side) {
  const double l = left - 0.5, t = top - 0.5, r = l + side, b = t + side;
  return {id, {Eigen::Vector2d(l, t), {r, t}, {r, b}, {l, b}}};
}

/// A grid of small tags; in every third block of 2 x 2 one large tag stands for the four.
std::vector<Tag> denseTags(int width, int height, int cell) {
  std::vector<Tag> tags;
  const int pitch = cell * (kTagCells + 2);
  const int columns = width / pitch, rows = height / pitch;
  const int left = (width - columns * pitch) / 2, top = (height - rows * pitch) / 2;
  int id = kFirstPatternId;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const bool is_whole_block = (row | 1) < rows && (column | 1) < columns;
      const bool is_large = is_whole_block && (column / 2 + row / 2) % 3 == 0;
      if (is_large && (row % 2 == 1 || column % 2 == 1)) continue;
      const int size = is_large ? 2 * cell : cell;
      tags.push_back(
          tagAt(id++, left + column * pitch + size, top + row * pitch + size, size * kTagCells));
    }
  }
  return tags;
}

/// Small tags four times as far apart, up to the picture's edges.
std::vector<Tag> sparseTags(int width, int height, int cell) {
  std::vector<Tag> tags;
  const int side = cell * kTagCells, pitch = 4 * cell * (kTagCells + 2);
  const auto count = [&](int size) { return std::max(2, 1 + (size - side - 2 * cell) / pitch); };
  const int columns = count(width), rows = count(height);
  int id = kFirstPatternId;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      tags.push_back(tagAt(id++, cell + column * (width - side - 2 * cell) / (columns - 1),
                           cell + row * (height - side - 2 * cell) / (rows - 1), side));
    }
  }
  return tags;
}

int cellAt(double share) {
  return std::clamp(static_cast<int>(std::floor(share * kTagCells)), 0, kTagCells - 1);
}

/// Draws a tag: a pixel whose center lies in the tag takes the color of the cell it lies in.
void drawTag(Picture& picture, const std::string& family, const Tag& tag) {
  const TagCells black = tagCells(family, tag.id);
  const Eigen::Vector2d &origin = tag.corners[0], right = tag.corners[1] - origin,
                        down = tag.corners[3] - origin;
  Eigen::Vector2d low = origin, high = origin;
  for (const Eigen::Vector2d& corner : tag.corners) {
    low = low.cwiseMin(corner);
    high = high.cwiseMax(corner);
  }
  const int left = std::max(0, static_cast<int>(std::floor(low.x())));
  const int top = std::max(0, static_cast<int>(std::floor(low.y())));
  const int x_end = std::min(picture.width, static_cast<int>(std::ceil(high.x())) + 1);
  const int y_end = std::min(picture.height, static_cast<int>(std::ceil(high.y())) + 1);
  for (int y = top; y < y_end; ++y) {
    for (int x = left; x < x_end; ++x) {
      const Eigen::Vector2d from_origin = Eigen::Vector2d(x, y) - origin;
      const double u = from_origin.dot(right) / right.squaredNorm();
      const double v = from_origin.dot(down) / down.squaredNorm();
      if (u < 0 || u >= 1 || v < 0 || v >= 1) continue;
      if (!black[static_cast<std::size_t>(cellAt(v))][static_cast<std::size_t>(cellAt(u))])
        continue;
      picture.pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width) +
                     static_cast<std::size_t>(x)] = 0;
    }
  }
}

}  // namespace

Pattern makePattern(int width, int height, const std::string& family, PatternUse use) {
  if (width < 320 || height < 200 || width > 8192 || height > 8192) {
    throw std::invalid_argument("a pattern of " + std::to_string(width) + " x " +
                                std::to_string(height) +
                                " pixels: expected 320 x 200 to 8192 x 8192");
  }
  const int ids = tagCount(family);
  Pattern pattern;
  pattern.family = family;
  pattern.width = width;
  pattern.height = height;
  for (int cell = cellPixels(std::max(width, height)); pattern.tags.empty(); ++cell) {
    pattern.tags =
        use == PatternUse::Pairs ? denseTags(width, height, cell) : sparseTags(width, height, cell);
    // A very wide picture: larger cells, fewer tags.
    if (pattern.tags.back().id >= ids) pattern.tags.clear();
  }
  return pattern;
}

Picture patternPicture(const Pattern& pattern) {
  Picture picture;
  picture.width = pattern.width;
  picture.height = pattern.height;
  picture.pixels.assign(
      static_cast<std::size_t>(pattern.width) * static_cast<std::size_t>(pattern.height), 255);
  for (const Tag& tag : pattern.tags) drawTag(picture, pattern.family, tag);
  return picture;
}

std::string patternPng(const Pattern& pattern) { return encodePng(patternPicture(pattern)); }

}  // namespace afterglow::calib
