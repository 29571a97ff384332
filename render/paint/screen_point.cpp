#include "render/paint/screen_point.hpp"

#include <algorithm>
#include <array>

namespace afterglow::render {
namespace {

constexpr int kDigitBits = 11;
constexpr std::uint32_t kDigits = 1u << kDigitBits;

/// Sorts in one pass of a radix sort: stable, by eleven bits of (order - least).
void sortByDigit(const ScreenPoint* from, std::size_t count, std::uint32_t least, int shift,
                 ScreenPoint* to) {
  std::array<std::uint32_t, kDigits> place{};
  const auto digit = [&](const ScreenPoint& p) {
    return (p.order - least) >> shift & (kDigits - 1);
  };
  for (std::size_t i = 0; i < count; ++i) ++place[digit(from[i])];
  std::uint32_t at = 0;
  for (std::uint32_t& first : place) {
    const std::uint32_t here = first;
    first = at;
    at += here;
  }
  for (std::size_t i = 0; i < count; ++i) to[place[digit(from[i])]++] = from[i];
}

}  // namespace

const ScreenPoint* sortByOrder(const ScreenPoint* points, std::size_t count,
                               std::vector<ScreenPoint>& room) {
  if (count < 2) return points;
  if (room.size() < 2 * count) room.resize(2 * count);
  const auto [least, greatest] = std::minmax_element(
      points, points + count, [](const auto& a, const auto& b) { return a.order < b.order; });
  const std::uint32_t first = least->order, range = greatest->order - first;
  ScreenPoint* to = room.data();
  for (int shift = 0; shift < 32 && range >> shift > 0; shift += kDigitBits) {
    sortByDigit(points, count, first, shift, to);
    points = to;
    to = points == room.data() ? room.data() + count : room.data();
  }
  return points;
}

}  // namespace afterglow::render
