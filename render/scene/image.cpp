#include "render/scene/image.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace afterglow::render {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr int kFaintest = 5;        // of 255: a jump that nobody sees
constexpr int kFaintestShare = 12;  // likewise, one of so many parts of the brightness
constexpr float kLongest = 6;       // px, along an edge
constexpr std::size_t kBatch = 16;  // px that are looked at together

struct Rgb {
  float r, g, b;
};
Rgb operator+(const Rgb& a, const Rgb& b) { return {a.r + b.r, a.g + b.g, a.b + b.b}; }
Rgb operator*(float s, const Rgb& c) { return {s * c.r, s * c.g, s * c.b}; }

float lumaOf(const Rgb& c) { return 0.30f * c.r + 0.59f * c.g + 0.11f * c.b; }

void fillLumas(const std::uint8_t* rgb, std::size_t count, std::uint8_t* luma) {
  for (std::size_t i = 0; i < count; ++i) {
    luma[i] = static_cast<std::uint8_t>(
        (77u * rgb[3 * i] + 151u * rgb[3 * i + 1] + 28u * rgb[3 * i + 2]) >> 8);
  }
}

/// 0 where the diagonal neighbors in the rows above and below are about as bright.
void findJumps(const std::uint8_t* above, const std::uint8_t* here, const std::uint8_t* below,
               std::size_t width, std::uint8_t* jumps) {
  for (std::size_t u = 1; u + 1 < width; ++u) {
    const std::uint8_t low = std::min(std::min(std::min(above[u - 1], above[u + 1]),
                                               std::min(below[u - 1], below[u + 1])),
                                      here[u]);
    const std::uint8_t high = std::max(std::max(std::max(above[u - 1], above[u + 1]),
                                                std::max(below[u - 1], below[u + 1])),
                                       here[u]);
    const int faintest = std::max(kFaintest, high / kFaintestShare);
    jumps[u] = high - low >= faintest ? 1 : 0;
  }
}

/// An image, and its brightness, that is read while another is written.
class Edges {
 public:
  explicit Edges(const Image& image)
      : image_(image),
        width_(static_cast<std::size_t>(image.width)),
        luma_(width_ * static_cast<std::size_t>(image.height)) {
    fillLumas(image.rgb.data(), luma_.size(), luma_.data());
  }

  /// Rows and columns at the border have too few neighbors.
  void smooth(Image& smoothed) const {
    Bytes jumps(width_ + kBatch, 0);
    for (int v = 1; v + 1 < image_.height; ++v) {
      findJumps(row(v - 1), row(v), row(v + 1), width_, jumps.data());
      for (std::size_t first = 0; first < width_; first += kBatch) {
        const auto begin = jumps.begin() + static_cast<std::ptrdiff_t>(first);
        if (std::find(begin, begin + kBatch, 1) == begin + kBatch) continue;
        for (std::size_t u = first; u < std::min(first + kBatch, width_); ++u) {
          if (jumps[u] != 0) put(smoothed, static_cast<int>(u), v);
        }
      }
    }
  }

 private:
  const std::uint8_t* row(int v) const {
    return luma_.data() + static_cast<std::size_t>(v) * width_;
  }

  /// Returns the color between pixels' centers; beyond the border as on it.
  Rgb at(float x, float y) const {
    x = std::clamp(x, 0.0f, static_cast<float>(image_.width - 1));
    y = std::clamp(y, 0.0f, static_cast<float>(image_.height - 1));
    const int u = std::min(static_cast<int>(x), image_.width - 2);
    const int v = std::min(static_cast<int>(y), image_.height - 2);
    const float right = x - static_cast<float>(u), down = y - static_cast<float>(v);
    const std::uint8_t* p =
        &image_.rgb[3 * (static_cast<std::size_t>(v) * width_ + static_cast<std::size_t>(u))];
    const std::uint8_t* q = p + 3 * width_;
    const auto between = [right](const std::uint8_t* pixel) {
      return static_cast<float>(pixel[0]) * (1 - right) + static_cast<float>(pixel[3]) * right;
    };
    const auto mixed = [&](int i) {
      return between(p + i) * (1 - down) + between(q + i) * down;
    };
    return {mixed(0), mixed(1), mixed(2)};
  }

  void put(Image& smoothed, int u, int v) const {
    const std::uint8_t *above = row(v - 1) + u, *here = row(v) + u, *below = row(v + 1) + u;
    const float nw = above[-1], ne = above[1], sw = below[-1], se = below[1], middle = *here;
    const float low = std::min(std::min(std::min(nw, ne), std::min(sw, se)), middle);
    const float high = std::max(std::max(std::max(nw, ne), std::max(sw, se)), middle);
    // Along the edge: across the gradient.
    float x = sw + se - nw - ne, y = nw + sw - ne - se;
    const float flattest = std::min(std::abs(x), std::abs(y)) + 0.03f * (nw + ne + sw + se) + 2;
    x = std::clamp(x / flattest, -kLongest, kLongest);
    y = std::clamp(y / flattest, -kLongest, kLongest);
    const auto both = [&](float share) {
      const auto fu = static_cast<float>(u), fv = static_cast<float>(v);
      return at(fu - share * x, fv - share * y) + at(fu + share * x, fv + share * y);
    };
    const Rgb near = 0.5f * both(1.0f / 6);
    const Rgb far = 0.5f * near + 0.25f * both(0.5f);
    const float reached = lumaOf(far);  // of bytes: up to 1 more than luma_ has
    const Rgb& mixed = reached < low || reached > high + 1 ? near : far;
    std::uint8_t* to =
        &smoothed.rgb[3 * (static_cast<std::size_t>(v) * width_ + static_cast<std::size_t>(u))];
    to[0] = static_cast<std::uint8_t>(mixed.r + 0.5f);
    to[1] = static_cast<std::uint8_t>(mixed.g + 0.5f);
    to[2] = static_cast<std::uint8_t>(mixed.b + 0.5f);
  }

  const Image& image_;
  std::size_t width_;
  Bytes luma_;
};

}  // namespace

void smoothEdges(Image& image) {
  if (image.width < 3 || image.height < 3) return;
  const Image drawn = image;
  Edges(drawn).smooth(image);
}

}  // namespace afterglow::render
