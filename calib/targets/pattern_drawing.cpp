#include "calib/targets/pattern_drawing.hpp"

#include <algorithm>
#include <cmath>

#include "calib/targets/png.hpp"
#include "calib/targets/tag_family.hpp"

namespace afterglow::calib {
namespace {

int cellAt(double share) {
  return std::clamp(static_cast<int>(std::floor(share * kTagCells)), 0, kTagCells - 1);
}

/// Every pixel whose center lies in the tag takes the color of the cell it lies in.
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
