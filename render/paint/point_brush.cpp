#include "render/paint/point_brush.hpp"

#include <cstring>

namespace afterglow::render {
namespace {

/// Two pixels' components: vector instructions where the machine has them (GCC and Clang).
using Pair = std::uint16_t __attribute__((vector_size(16)));

Light opaque(std::uint32_t color) {
  const auto lane = [color](int shift) {
    return static_cast<std::uint16_t>(color >> shift & 0xff);
  };
  return Light{lane(0), lane(8), lane(16), 255};
}

Pair twice(Light light) {
  Pair pair;
  std::memcpy(&pair, &light, sizeof(light));
  std::memcpy(reinterpret_cast<char*>(&pair) + sizeof(light), &light, sizeof(light));
  return pair;
}

/// Two pixels' shares of 255 in all their components.
Pair sharesOf(std::uint32_t first, std::uint32_t second) {
  constexpr std::uint64_t kEach = 0x0001000100010001u;
  using Words = std::uint64_t __attribute__((vector_size(16)));
  return reinterpret_cast<Pair>(Words{first * kEach, second * kEach});
}

/// The source's shares over two pixels, rounded as division by 255 is.
void mix(Light* pixels, Pair source, Pair shares) {
  Pair below;
  std::memcpy(&below, pixels, sizeof(below));
  const Pair sum = below * (255 - shares) + source * shares + 128;
  const Pair result = (sum + (sum >> 8)) >> 8;
  std::memcpy(pixels, &result, sizeof(result));
}

int subpixels(float size_px) {
  return static_cast<int>(std::lround(std::max(0.f, size_px) * kSubpixels));
}

/// First subpixel of a square around `center`; pixel i begins at i * kSubpixels.
int begin(std::int32_t center, int size) { return center + kSubpixels / 2 - size / 2; }

/// How much of pixel i lies between two subpixels.
std::uint32_t overlap(int i, int from, int to) {
  return static_cast<std::uint32_t>(std::min(to, (i + 1) * kSubpixels) -
                                    std::max(from, i * kSubpixels));
}

/// What ScreenPoint::order was made of.
float depthOf(std::uint32_t order) {
  const std::uint32_t bits = order >> 31 ? order : ~order & 0x7fffffffu;
  float depth;
  std::memcpy(&depth, &bits, sizeof(depth));
  return depth;
}

}  // namespace

Rows rowsOfPoint(const ScreenPoint& point, float size_px) {
  const int size = subpixels(size_px), top = begin(point.v, size);
  return {top >> 8, (top + size - 1) >> 8};  // shifts round down, also below zero
}

PointBrush::PointBrush(int width, float size_px)
    : width_(width),
      size_(subpixels(size_px)),
      shares_(static_cast<std::size_t>(size_ / kSubpixels) + 3) {}

void PointBrush::paint(const ScreenPoint& point, int row_begin, int row_end,
                       const std::uint16_t* mask, Canvas& canvas) {
  const int left = begin(point.u, size_), right = left + size_;
  const int top = begin(point.v, size_), bottom = top + size_;
  const int u_begin = std::max(0, left >> 8), u_end = std::min(width_, (right + 255) >> 8);
  const int v_begin = std::max(row_begin, top >> 8), v_end = std::min(row_end, (bottom + 255) >> 8);
  if (u_begin >= u_end) return;
  std::uint32_t* shares = shares_.data();
  for (int u = u_begin; u < u_end; ++u) shares[u - u_begin] = overlap(u, left, right);
  shares[u_end - u_begin] = 0;
  const std::uint32_t alpha = point.color >> 24;
  const Light light = opaque(point.color);
  const bool is_plain = mask == nullptr && !canvas.hasCovers();
  for (int v = v_begin; v < v_end; ++v) {
    const std::uint32_t row_share = overlap(v, top, bottom) * alpha;
    const auto shareAt = [&](int i) { return (shares[i] * row_share + 0x8000) >> 16; };
    if (is_plain) {
      Light* row = canvas.behind(v - row_begin) + u_begin;
      const Pair source = twice(light);
      // A pixel past the end has no share and stays as it is.
      for (int i = 0; i < u_end - u_begin; i += 2) {
        mix(row + i, source, sharesOf(shareAt(i), shareAt(i + 1)));
      }
      continue;
    }
    for (int u = u_begin; u < u_end; ++u) {
      std::uint32_t share = shareAt(u - u_begin);
      if (mask != nullptr) share = share * mask[(v - row_begin) * width_ + u] >> 8;
      const auto part = static_cast<std::uint16_t>(share);
      canvas.lay(v - row_begin, u, (light * part + 127) / 255, depthOf(point.order));
    }
  }
}

}  // namespace afterglow::render
