#include "render/paint/canvas.hpp"

#include "render/paint/band_bins.hpp"

namespace afterglow::render {
namespace {

constexpr std::uint16_t kAlpha = 3;  ///< lane

/// `below` under premultiplied light.
Light over(Light below, Light light) {
  const auto rest = static_cast<std::uint16_t>(255 - light[kAlpha]);
  const Light sum = below * rest + 128;
  return light + ((sum + (sum >> 8)) >> 8);
}

/// The same for a sum of shares.
Light sumOver(Light sum, std::uint32_t share, Light light) {
  const std::uint32_t rest = 255u - light[kAlpha];
  Light out;
  for (int lane = 0; lane < 4; ++lane) {
    out[lane] = static_cast<std::uint16_t>((sum[lane] * rest + 127) / 255 + light[lane] * share);
  }
  return out;
}

}  // namespace

Canvas::Canvas(int width)
    : width_(width),
      behind_(static_cast<std::size_t>(width) * kBandRows, Light{}),
      covers_(static_cast<std::size_t>(width) * kBandRows),
      touched_(kBandRows, Touched{width, 0}) {}

void Canvas::clear() {
  for (int row = 0; has_covers_ && row < kBandRows; ++row) forget(row);
  std::fill(behind_.begin(), behind_.end(), Light{});
  has_covers_ = false;
}

void Canvas::forget(int row) {
  Touched& touched = touched_[static_cast<std::size_t>(row)];
  for (int column = touched.begin; column < touched.end; ++column)
    covers_[at(row, column)].share = 0;
  touched = {width_, 0};
}

void Canvas::lay(int row, int column, Light light, float depth) {
  const std::size_t i = at(row, column);
  Cover& cover = covers_[i];
  const bool is_hidden = cover.share > 0 && depth > cover.depth;
  if (is_hidden && cover.share == kWhole) return;
  behind_[i] = over(behind_[i], light);
  if (cover.share > 0 && !is_hidden) cover.sum = sumOver(cover.sum, cover.share, light);
}

void Canvas::flatten() {
  if (!has_covers_) return;
  for (int row = 0; row < kBandRows; ++row) finish(row);
  has_covers_ = false;
}

void Canvas::lay(Canvas& other) {
  if (!other.has_covers_) return;
  for (int row = 0; row < kBandRows; ++row) {
    const Touched touched = other.touched_[static_cast<std::size_t>(row)];
    for (int column = touched.begin; column < touched.end; ++column) {
      const std::size_t i = at(row, column);
      if (other.covers_[i].share == 0) continue;
      lay(row, column, other.seen(i), other.covers_[i].depth);
      other.behind_[i] = Light{};
    }
    other.forget(row);
  }
  other.has_covers_ = false;
}

const Light* Canvas::finish(int row) {
  Touched& touched = touched_[static_cast<std::size_t>(row)];
  for (int column = touched.begin; column < touched.end; ++column) {
    const std::size_t i = at(row, column);
    if (covers_[i].share == 0) continue;
    behind_[i] = seen(i);
    covers_[i].share = 0;
  }
  touched = {width_, 0};
  return behind(row);
}

}  // namespace afterglow::render
