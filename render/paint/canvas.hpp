/// \file
/// The pixels of one band while it is painted: each knows the surface that covers it, how far away
/// that is, and the light behind it where it covers the pixel in part. That is the A-buffer's idea
/// (Carpenter 1984) kept to two layers: edges are exact wherever no more than two surfaces meet in
/// a pixel.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace afterglow::render {

/// r, g, b multiplied by alpha, and alpha, 0..255 each, in lanes of 16 bits.
using Light = std::uint16_t __attribute__((vector_size(8)));

constexpr std::uint32_t kWhole = 256;  ///< share of a fully covered pixel

/// Mixes a share and the rest, rounded.
inline Light mixed(Light below, Light above, std::uint32_t share) {
  const auto w = static_cast<std::uint16_t>(share);
  return (below * static_cast<std::uint16_t>(kWhole - w) + above * w + 128) >> 8;
}

/// The surface that covers a pixel.
struct Cover {
  Light sum = {};           ///< sum of light * share: below 2^16, as shares add up to kWhole
  float depth = 0;          ///< less is nearer
  float slack = 0;          ///< so far the depths of one surface differ within the pixel
  std::uint32_t share = 0;  ///< 0: no surface does
};

class Canvas {
 public:
  explicit Canvas(int width);

  /// Forgets everything: nothing anywhere.
  void clear();
  /// Returns true if add() has been used since clear() or flatten().
  bool hasCovers() const { return has_covers_; }

  /// The light behind the covers; all of a pixel's light if no surface covers it.
  Light* behind(int row) { return behind_.data() + at(row, 0); }

  /// An opaque surface (or, on a canvas of its own, a translucent one) covers a share of a pixel.
  /// Of surfaces at the same depth each covers what the others leave, as neighbors do that share an
  /// edge; a nearer one hides what is behind it.
  void add(int row, int column, Light light, std::uint32_t share, float depth, float slack) {
    const std::size_t i = at(row, column);
    Cover& cover = covers_[i];
    const auto alone = [&] {
      cover = {light * static_cast<std::uint16_t>(share), depth, slack, share};
    };
    if (cover.share == 0) return alone();
    const float apart = depth - cover.depth;
    const bool is_beside =
        std::abs(apart) <= slack + cover.slack && share + cover.share <= kWhole + kRounding;
    if (is_beside) {
      const std::uint32_t rest = std::min(share, kWhole - cover.share);
      cover.sum += light * static_cast<std::uint16_t>(rest);
      cover.share += rest;
      cover.depth = std::min(cover.depth, depth);
      cover.slack = std::max(cover.slack, slack);
    } else if (apart <= 0) {
      if (share < kWhole) behind_[i] = seen(i);
      alone();
    } else if (cover.share < kWhole) {
      behind_[i] = mixed(behind_[i], light, share);
    }
  }

  /// Says that add() may be called for these columns of a row.
  void touch(int row, int begin, int end) {
    Touched& touched = touched_[static_cast<std::size_t>(row)];
    touched.begin = std::min(touched.begin, begin);
    touched.end = std::max(touched.end, end);
    has_covers_ = true;
  }

  /// Lays light, multiplied by alpha, over a pixel, where nothing nearer than `depth` covers it.
  void lay(int row, int column, Light light, float depth);

  /// The covers join the light behind them: all that is drawn next lies over it.
  void flatten();

  /// Lays the covers of another canvas over this one where they are nearer; clears that one.
  void lay(Canvas& other);

  /// A row as it is seen; on the canvas itself, which is to be cleared next.
  const Light* finish(int row);

 private:
  /// Shares of neighbors are rounded each for itself.
  static constexpr std::uint32_t kRounding = 6;

  struct Touched {
    int begin, end;
  };

  Light seen(std::size_t i) const {
    const Cover& cover = covers_[i];
    const auto rest = static_cast<std::uint16_t>(kWhole - cover.share);
    return (cover.sum + behind_[i] * rest + 128) >> 8;
  }
  void forget(int row);
  std::size_t at(int row, int column) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(column);
  }

  int width_;
  bool has_covers_ = false;
  std::vector<Light> behind_;
  std::vector<Cover> covers_;
  std::vector<Touched> touched_;  ///< columns of each row that may be covered
};

}  // namespace afterglow::render
