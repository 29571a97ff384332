#include "render/paint/point_brush.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "render/paint/vector_clones.hpp"

namespace afterglow::render {
namespace {

constexpr std::size_t kLanes = 4;  // of a Light
constexpr int kLights = 4;         // worked on at once
using Lights = std::uint16_t __attribute__((vector_size(8 * kLights)));

Light opaque(std::uint32_t color) {
  const auto lane = [color](int shift) {
    return static_cast<std::uint16_t>(color >> shift & 0xff);
  };
  return Light{lane(0), lane(8), lane(16), 255};
}

/// Shares of `source` over some pixels, rounded as division by 255 is.
AFTERGLOW_ALWAYS_INLINE void mix(Light* pixels, const Lights& source, const std::uint16_t* lanes,
                                 std::uint16_t each) {
  Lights below, shares;
  std::memcpy(&below, pixels, sizeof(below));
  std::memcpy(&shares, lanes, sizeof(shares));
  shares = (shares * each + 128) >> 8;
  const Lights sum = below * (255 - shares) + source * shares + 128;
  const Lights result = (sum + (sum >> 8)) >> 8;
  std::memcpy(pixels, &result, sizeof(result));
}

/// The depth that ScreenPoint::order was made of.
float depthOf(std::uint32_t order) {
  const std::uint32_t bits = order >> 31 ? order : ~order & 0x7fffffffu;
  float depth;
  std::memcpy(&depth, &bits, sizeof(depth));
  return depth;
}

}  // namespace

PointBrush::PointBrush(float size_px)
    : size_(static_cast<int>(std::lround(std::max(0.f, size_px) * kSubpixels))),
      stride_((static_cast<std::size_t>(size_ / kSubpixels) + 2 + kLights - 1) / kLights *
              kLights) {
  shares_.resize(kSubpixels * stride_);
  for (int fraction = 0; fraction < kSubpixels; ++fraction) {
    for (int i = 0; i < static_cast<int>(stride_); ++i) {
      const int from = std::max(fraction, i * kSubpixels);
      const int to = std::min(fraction + size_, (i + 1) * kSubpixels);
      shares_[static_cast<std::size_t>(fraction) * stride_ + static_cast<std::size_t>(i)] =
          static_cast<std::uint16_t>(std::max(0, to - from));
    }
  }
  for (const std::uint16_t share : shares_) lanes_.insert(lanes_.end(), kLanes, share);
}

AFTERGLOW_VECTOR_CLONES
void PointBrush::paint(const ScreenPoint* points, std::size_t count, int row_begin, int row_end,
                       int width, const std::uint16_t* mask, Canvas& canvas) const {
  const bool is_plain = mask == nullptr && !canvas.hasCovers();
  for (std::size_t i = 0; i < count; ++i) {
    const int first = begin(points[i].u) >> 8;
    if (is_plain && first >= 0 && first + static_cast<int>(stride_) <= width) {
      paintPlain(points[i], row_begin, row_end, canvas);
    } else {
      paintOne(points[i], row_begin, row_end, width, mask, canvas);
    }
  }
}

AFTERGLOW_ALWAYS_INLINE void PointBrush::paintPlain(const ScreenPoint& point, int row_begin,
                                                    int row_end, Canvas& canvas) const {
  const int left = begin(point.u), top = begin(point.v);
  const int u_begin = left >> 8, v_first = top >> 8;
  const int columns = ((left + size_ + 255) >> 8) - u_begin;
  const int v_begin = std::max(row_begin, v_first);
  const int v_end = std::min(row_end, (top + size_ + 255) >> 8);
  const std::uint16_t* rows = shares(top & (kSubpixels - 1)) - v_first;
  const std::uint16_t* lanes =
      &lanes_[kLanes * stride_ * static_cast<std::size_t>(left & (kSubpixels - 1))];
  const std::uint32_t alpha = point.color >> 24;
  Lights source;
  repeat(opaque(point.color), source);
  for (int v = v_begin; v < v_end; ++v) {
    const auto each = static_cast<std::uint16_t>((rows[v] * alpha + 128) >> 8);
    Light* row = canvas.behind(v - row_begin) + u_begin;
    // A pixel past the end has no share and stays as it is.
    for (int i = 0; i < columns; i += kLights) {
      mix(row + i, source, lanes + kLanes * static_cast<std::size_t>(i), each);
    }
  }
}

void PointBrush::paintOne(const ScreenPoint& point, int row_begin, int row_end, int width,
                          const std::uint16_t* mask, Canvas& canvas) const {
  const int left = begin(point.u), top = begin(point.v);
  const int u_first = left >> 8, v_first = top >> 8;
  const int u_begin = std::max(0, u_first), u_end = std::min(width, (left + size_ + 255) >> 8);
  const int v_begin = std::max(row_begin, v_first);
  const int v_end = std::min(row_end, (top + size_ + 255) >> 8);
  if (u_begin >= u_end) return;
  const std::uint16_t* columns = shares(left & (kSubpixels - 1)) + (u_begin - u_first);
  const std::uint16_t* rows = shares(top & (kSubpixels - 1)) - v_first;
  const std::uint32_t alpha = point.color >> 24;
  const Light light = opaque(point.color);
  for (int v = v_begin; v < v_end; ++v) {
    const std::uint32_t row_share = rows[v] * alpha;
    for (int u = u_begin; u < u_end; ++u) {
      std::uint32_t share = (columns[u - u_begin] * row_share + 0x8000) >> 16;
      if (mask != nullptr) share = share * mask[(v - row_begin) * width + u] >> 8;
      const auto part = static_cast<std::uint16_t>(share);
      canvas.lay(v - row_begin, u, (light * part + 127) / 255, depthOf(point.order));
    }
  }
}

}  // namespace afterglow::render
