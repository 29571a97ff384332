#include "render/paint/canvas.hpp"

#include <limits>

#include "render/paint/band_bins.hpp"

namespace afterglow::render {
namespace {

constexpr std::uint16_t kAlpha = 3;  ///< lane
constexpr float kFarthest = std::numeric_limits<float>::infinity();

/// `below` under premultiplied light.
Light over(Light below, Light light) {
  const auto rest = static_cast<std::uint16_t>(255 - light[kAlpha]);
  const Light sum = below * rest + 128;
  return light + ((sum + (sum >> 8)) >> 8);
}

/// The same for a sum of shares.
Light sumOver(Light sum, int share, Light light) {
  const int rest = 255 - light[kAlpha];
  Light out;
  for (int lane = 0; lane < 4; ++lane) {
    out[lane] = static_cast<std::uint16_t>((sum[lane] * rest + 127) / 255 + light[lane] * share);
  }
  return out;
}

}  // namespace

Canvas::Canvas(int width) : width_(width), touched_(kBandRows, Touched{width, 0}) {
  const std::size_t pixels = at(kBandRows, kPixelsAtOnce);
  behind_.resize(pixels);
  sums_.resize(pixels);
  shares_.resize(pixels);
  depths_.resize(pixels, kFarthest);
  slacks_.resize(pixels);
}

void Canvas::clear() {
  for (int row = 0; has_covers_ && row < kBandRows; ++row) forget(row);
  std::fill(behind_.begin(), behind_.end(), Light{});
  has_covers_ = false;
}

void Canvas::forget(int row) {
  Touched& touched = touched_[static_cast<std::size_t>(row)];
  const auto first = static_cast<std::ptrdiff_t>(at(row, touched.begin));
  const int columns = std::max(0, touched.end - touched.begin);
  std::fill_n(shares_.begin() + first, columns, 0);
  std::fill_n(sums_.begin() + first, columns, Light{});
  std::fill_n(depths_.begin() + first, columns, kFarthest);
  touched = {width_, 0};
}

void Canvas::lay(int row, int column, Light light, float depth) {
  const std::size_t i = at(row, column);
  const int share = shares_[i];
  const bool is_hidden = share > 0 && depth > depths_[i];
  if (is_hidden && share == kWhole) return;
  behind_[i] = over(behind_[i], light);
  if (share > 0 && !is_hidden) sums_[i] = sumOver(sums_[i], share, light);
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
      if (other.shares_[i] == 0) continue;
      lay(row, column, other.seen(i), other.depths_[i]);
      other.behind_[i] = Light{};
    }
    other.forget(row);
  }
  other.has_covers_ = false;
}

const Light* Canvas::finish(int row) {
  const Touched& touched = touched_[static_cast<std::size_t>(row)];
  for (int column = touched.begin; column < touched.end; ++column) {
    const std::size_t i = at(row, column);
    behind_[i] = seen(i);
  }
  forget(row);
  return behind(row);
}

}  // namespace afterglow::render
