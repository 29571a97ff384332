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

/// The most pixels side by side that are worked on at once.
constexpr int kPixelsAtOnce = 8;

/// Vectors (GCC and Clang) of pixels side by side, as many as lanes of 32 bits. Their lights are
/// two.
template <int kPixels>
struct PixelVectors {
  // A `using` would lose a size that depends on the template.
  typedef std::int32_t Shares __attribute__((vector_size(4 * kPixels)));
  typedef float Depths __attribute__((vector_size(4 * kPixels)));
  typedef std::uint16_t Lights __attribute__((vector_size(4 * kPixels)));
  typedef Lights LightPair[2];
};

/// The same light for each, put together in registers: pieces of it that were written to memory
/// could not be read as one at once.
template <typename Lights>
AFTERGLOW_ALWAYS_INLINE void repeat(Light light, Lights& out) {
  typedef std::uint64_t Words __attribute__((vector_size(sizeof(Lights))));
  std::uint64_t word;
  std::memcpy(&word, &light, sizeof(word));
  const Words words = word - Words{};
  std::memcpy(&out, &words, sizeof(out));
}

/// Puts numbers below 2^16 into all lanes of their pixels' lights, from pixel kFirst on.
template <int kFirst, typename Shares, typename Lights, int... kLanes>
AFTERGLOW_ALWAYS_INLINE void spread(const Shares& numbers, Lights& out,
                                    std::integer_sequence<int, kLanes...> /*lanes*/) {
  const Shares doubled = numbers | numbers << 16;
  Shares twice;
  shuffle<(kFirst + kLanes / 2)...>(doubled, doubled, twice);
  std::memcpy(&out, &twice, sizeof(out));
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
  template <int kPixels>
  AFTERGLOW_ALWAYS_INLINE void add(int row, int column,
                                   const typename PixelVectors<kPixels>::LightPair& lights,
                                   const typename PixelVectors<kPixels>::Shares& share,
                                   const typename PixelVectors<kPixels>::Depths& depth,
                                   float slack) {
    using Shares = typename PixelVectors<kPixels>::Shares;
    using Depths = typename PixelVectors<kPixels>::Depths;
    const std::size_t i = at(row, column);
    Shares covered;
    Depths there, slack_there;
    std::memcpy(&covered, &shares_[i], sizeof(covered));
    std::memcpy(&there, &depths_[i], sizeof(there));
    std::memcpy(&slack_there, &slacks_[i], sizeof(slack_there));
    // Where nothing covers a pixel, `there` is infinite. Signs become masks: of comparisons the
    // compiler makes choices, which take three times as long.
    const Depths apart = there - depth;
    Depths distance = apart;
    makePositive<Depths, Shares>(distance);
    const Shares rest = kWhole - covered, is_touched = -share >> 31;
    const Shares is_hidden = reinterpret_cast<Shares>(apart) >> 31;
    const Shares is_apart = reinterpret_cast<Shares>(slack + slack_there - distance) >> 31;
    const Shares is_fitting = (share - rest - (kRounding + 1)) >> 31;
    const Shares is_beside = is_touched & is_fitting & ~is_apart;
    const Shares is_nearer = is_touched & ~is_beside & ~is_hidden;
    const Shares is_new = is_nearer | is_beside, gone = is_nearer & covered;
    const Shares room = rest + gone, joins = is_new & (share < room ? share : room);
    // Behind a whole cover anything may lie: it is not seen.
    const Shares mixes = share & ~is_new, stays = kWhole - mixes - gone;
    mix<0>(i, lights[0], joins, mixes, stays, is_nearer);
    mix<kPixels / 2>(i, lights[1], joins, mixes, stays, is_nearer);
    covered += joins - gone;
    // Not a number where it is not new, which is not less.
    const auto nearest = reinterpret_cast<Depths>(reinterpret_cast<Shares>(depth) | ~is_new);
    there = nearest < there ? nearest : there;
    const auto slack_here =
        reinterpret_cast<Depths>(reinterpret_cast<Shares>(slack - Depths{}) & is_new);
    const auto slack_kept =
        reinterpret_cast<Depths>(reinterpret_cast<Shares>(slack_there) & ~is_nearer);
    slack_there = slack_here < slack_kept ? slack_kept : slack_here;
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

  /// Mixes light with that of pixels from i + kFirst on: the shares that join the covers', that mix
  /// with what is behind, and that stay of it; `hides`: the covers' light goes behind.
  template <int kFirst, typename Lights, typename Shares>
  AFTERGLOW_ALWAYS_INLINE void mix(std::size_t i, const Lights& light, const Shares& joins,
                                   const Shares& mixes, const Shares& stays, const Shares& hides) {
    constexpr Lanes<sizeof(Shares) / sizeof(joins[0])> kEach{};
    Lights behind, sum, joins_each, mixes_each, stays_each, hides_each;
    std::memcpy(&behind, &behind_[i + kFirst], sizeof(behind));
    std::memcpy(&sum, &sums_[i + kFirst], sizeof(sum));
    spread<kFirst>(joins, joins_each, kEach);
    spread<kFirst>(mixes, mixes_each, kEach);
    spread<kFirst>(stays, stays_each, kEach);
    spread<kFirst>(hides, hides_each, kEach);
    behind = ((sum & hides_each) + light * mixes_each + behind * stays_each + 128) >> 8;
    sum = (sum & ~hides_each) + light * joins_each;
    std::memcpy(&behind_[i + kFirst], &behind, sizeof(behind));
    std::memcpy(&sums_[i + kFirst], &sum, sizeof(sum));
  }
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
