/// \file
/// The pixels of one band while it is painted: each knows the surface that covers it, how far away
/// that is, and the light behind it where it covers the pixel in part. That is the A-buffer's idea
/// (Carpenter 1984) kept to two layers: edges are exact wherever no more than two surfaces meet in
/// a pixel.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "render/paint/vector_clones.hpp"

namespace afterglow::render {

/// r, g, b multiplied by alpha, and alpha, 0..255 each, in lanes of 16 bits.
using Light = std::uint16_t __attribute__((vector_size(8)));

constexpr int kWhole = 256;  ///< share of a fully covered pixel

/// Pixels side by side, worked on at once: vector instructions where the machine has them (GCC and
/// Clang).
constexpr int kPixelsAtOnce = 4;
using Lights = std::uint16_t __attribute__((vector_size(8 * kPixelsAtOnce)));
using Shares = std::int32_t __attribute__((vector_size(4 * kPixelsAtOnce)));
using Depths = float __attribute__((vector_size(4 * kPixelsAtOnce)));

/// The same light for each, put together in registers: pieces of it that were written to memory
/// could not be read as one at once.
AFTERGLOW_ALWAYS_INLINE void repeat(Light light, Lights& out) {
  using Words = std::uint64_t __attribute__((vector_size(sizeof(Lights))));
  std::uint64_t word;
  std::memcpy(&word, &light, sizeof(word));
  const Words words = word - Words{};
  std::memcpy(&out, &words, sizeof(out));
}

/// Puts each pixel's two numbers, of the lower and of the upper half of 32 bits, into all lanes of
/// its light.
AFTERGLOW_ALWAYS_INLINE void spread(const Shares& numbers, Lights& lower, Lights& upper) {
  const auto twice = __builtin_shufflevector(numbers, numbers, 0, 0, 1, 1, 2, 2, 3, 3);
  Lights both;
  std::memcpy(&both, &twice, sizeof(both));
  lower = __builtin_shufflevector(both, both, 0, 0, 0, 0, 4, 4, 4, 4, 8, 8, 8, 8, 12, 12, 12, 12);
  upper = __builtin_shufflevector(both, both, 1, 1, 1, 1, 5, 5, 5, 5, 9, 9, 9, 9, 13, 13, 13, 13);
}

/// The absolute values of floats, without a decision.
template <typename Floats, typename Ints>
AFTERGLOW_ALWAYS_INLINE void makePositive(Floats& values) {
  values = reinterpret_cast<Floats>(reinterpret_cast<Ints>(values) & 0x7fffffff);
}

class Canvas {
 public:
  explicit Canvas(int width);

  /// Forgets everything: nothing anywhere.
  void clear();
  /// Returns true if add() has been used since clear() or flatten().
  bool hasCovers() const { return has_covers_; }

  /// The light behind the covers; all of a pixel's light if no surface covers it.
  Light* behind(int row) { return behind_.data() + at(row, 0); }

  /// An opaque surface (or, on a canvas of its own, a translucent one) covers shares of pixels from
  /// `column` on; they may lie beyond the row's end if their shares are 0. Of surfaces at the same
  /// depth each covers what the others leave, as neighbors do that share an edge; a nearer one
  /// hides what is behind it. `slack`: so far the depths of the surface differ within a pixel.
  AFTERGLOW_ALWAYS_INLINE void add(int row, int column, const Lights& light, const Shares& share,
                                   const Depths& depth, float slack) {
    const std::size_t i = at(row, column);
    Shares covered;
    Depths there, slack_there;
    std::memcpy(&covered, &shares_[i], sizeof(covered));
    std::memcpy(&there, &depths_[i], sizeof(there));
    std::memcpy(&slack_there, &slacks_[i], sizeof(slack_there));
    // Where nothing covers a pixel, `there` is infinite.
    const Depths apart = depth - there;
    Depths distance = apart;
    makePositive<Depths, Shares>(distance);
    const Shares rest = kWhole - covered, is_touched = share > 0;
    const Shares is_beside =
        is_touched & (distance <= slack + slack_there) & (share - rest <= kRounding);
    const Shares is_nearer = is_touched & ~is_beside & (apart <= 0);
    const Shares is_new = is_nearer | is_beside, gone = is_nearer & covered;
    const Shares room = rest + gone, joins = is_new & (share < room ? share : room);
    // Behind a whole cover anything may lie: it is not seen.
    const Shares mixes = share & ~is_new, stays = kWhole - mixes - gone;

    Lights behind, sum, joins_each, mixes_each, stays_each, hides;
    std::memcpy(&behind, &behind_[i], sizeof(behind));
    std::memcpy(&sum, &sums_[i], sizeof(sum));
    spread(joins | mixes << 16, joins_each, mixes_each);
    spread(stays | is_nearer << 16, stays_each, hides);
    behind = ((sum & hides) + light * mixes_each + behind * stays_each + 128) >> 8;
    sum = (sum & ~hides) + light * joins_each;
    covered += joins - gone;
    // Not a number where it is not new, which is not less.
    const auto nearest = reinterpret_cast<Depths>(reinterpret_cast<Shares>(depth) | ~is_new);
    there = nearest < there ? nearest : there;
    const auto slack_here =
        reinterpret_cast<Depths>(reinterpret_cast<Shares>(slack - Depths{}) & is_new);
    const auto slack_kept =
        reinterpret_cast<Depths>(reinterpret_cast<Shares>(slack_there) & ~is_nearer);
    slack_there = slack_here < slack_kept ? slack_kept : slack_here;
    std::memcpy(&behind_[i], &behind, sizeof(behind));
    std::memcpy(&sums_[i], &sum, sizeof(sum));
    std::memcpy(&shares_[i], &covered, sizeof(covered));
    std::memcpy(&depths_[i], &there, sizeof(there));
    std::memcpy(&slacks_[i], &slack_there, sizeof(slack_there));
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
  static constexpr int kRounding = 6;

  struct Touched {
    int begin, end;
  };

  Light seen(std::size_t i) const {
    const auto rest = static_cast<std::uint16_t>(kWhole - shares_[i]);
    return (sums_[i] + behind_[i] * rest + 128) >> 8;
  }
  void forget(int row);
  std::size_t at(int row, int column) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(column);
  }

  int width_;
  bool has_covers_ = false;
  /// By pixel, and room for more at once.
  std::vector<Light> behind_;
  std::vector<Light> sums_;  ///< sums of light * share: below 2^16, as shares add up to kWhole
  std::vector<std::int32_t> shares_;  ///< 0: no surface covers the pixel, and its sum is 0
  std::vector<float> depths_;         ///< less is nearer; infinite where nothing is
  std::vector<float> slacks_;
  std::vector<Touched> touched_;  ///< columns of each row that may be covered
};

}  // namespace afterglow::render
