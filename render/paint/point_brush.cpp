#include "render/paint/point_brush.hpp"

#include <cstring>

namespace afterglow::render {
namespace {

Light opaque(std::uint32_t color) {
  const auto lane = [color](int shift) {
    return static_cast<std::uint16_t>(color >> shift & 0xff);
  };
  return Light{lane(0), lane(8), lane(16), 255};
}

LightPair twice(Light light) {
  LightPair pair;
  std::memcpy(&pair, &light, sizeof(light));
  std::memcpy(reinterpret_cast<char*>(&pair) + sizeof(light), &light, sizeof(light));
  return pair;
}

/// The source's shares over two pixels, rounded as division by 255 is.
void mix(Light* pixels, LightPair source, LightPair shares) {
  LightPair below;
  std::memcpy(&below, pixels, sizeof(below));
  const LightPair sum = below * (255 - shares) + source * shares + 128;
  const LightPair result = (sum + (sum >> 8)) >> 8;
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
      stride_((static_cast<std::size_t>(size_ / kSubpixels) + 4) / 2 * 2) {
  shares_.resize(kSubpixels * stride_);
  for (int fraction = 0; fraction < kSubpixels; ++fraction) {
    for (int i = 0; i < static_cast<int>(stride_); ++i) {
      const int from = std::max(fraction, i * kSubpixels);
      const int to = std::min(fraction + size_, (i + 1) * kSubpixels);
      shares_[static_cast<std::size_t>(fraction) * stride_ + static_cast<std::size_t>(i)] =
          static_cast<std::uint16_t>(std::max(0, to - from));
    }
  }
  for (std::size_t i = 0; i < shares_.size(); i += 2) {
    const std::uint16_t a = shares_[i], b = shares_[i + 1];
    pairs_.push_back(LightPair{a, a, a, a, b, b, b, b});
  }
}

void PointBrush::paint(const ScreenPoint& point, int row_begin, int row_end, int width,
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
  const LightPair source = twice(light);
  const bool is_clipped = u_begin != u_first || u_first + static_cast<int>(stride_) > width;
  const bool is_plain = mask == nullptr && !canvas.hasCovers() && !is_clipped;
  const LightPair* pairs = &pairs_[static_cast<std::size_t>(left & (kSubpixels - 1)) * stride_ / 2];
  for (int v = v_begin; v < v_end; ++v) {
    const std::uint32_t row_share = rows[v] * alpha;
    if (is_plain) {
      const auto each = static_cast<std::uint16_t>((row_share + 128) >> 8);
      Light* row = canvas.behind(v - row_begin) + u_begin;
      // A pixel past the end has no share and stays as it is.
      for (int i = 0; i < u_end - u_begin; i += 2) {
        mix(row + i, source, (pairs[i / 2] * each + 128) >> 8);
      }
      continue;
    }
    const auto shareAt = [&](int i) { return (columns[i] * row_share + 0x8000) >> 16; };
    for (int u = u_begin; u < u_end; ++u) {
      std::uint32_t share = shareAt(u - u_begin);
      if (mask != nullptr) share = share * mask[(v - row_begin) * width + u] >> 8;
      const auto part = static_cast<std::uint16_t>(share);
      canvas.lay(v - row_begin, u, (light * part + 127) / 255, depthOf(point.order));
    }
  }
}

}  // namespace afterglow::render
