#include "render/paint/screen_point.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace afterglow::render {
namespace {

constexpr int kMostDigitBits = 11;

/// Sorts in one pass of a radix sort: stable, by a digit of (order - least).
void sortByDigit(const ScreenPoint* from, std::size_t count, std::uint32_t least, int shift,
                 int digit_bits, ScreenPoint* to) {
  std::array<std::uint32_t, 1u << kMostDigitBits> place;
  const std::uint32_t digits = 1u << digit_bits;
  std::fill_n(place.begin(), digits, 0);
  const auto digit = [&](const ScreenPoint& p) {
    return (p.order - least) >> shift & (digits - 1);
  };
  for (std::size_t i = 0; i < count; ++i) ++place[digit(from[i])];
  std::uint32_t at = 0;
  for (std::uint32_t i = 0; i < digits; ++i) at += std::exchange(place[i], at);
  for (std::size_t i = 0; i < count; ++i) to[place[digit(from[i])]++] = from[i];
}

}  // namespace

const ScreenPoint* sortByOrder(const ScreenPoint* points, std::size_t count,
                               std::vector<ScreenPoint>& room) {
  if (count < 2) return points;
  if (room.size() < 2 * count) room.resize(2 * count);
  std::uint32_t least = points[0].order, greatest = least;
  for (std::size_t i = 1; i < count; ++i) {
    least = std::min(least, points[i].order);
    greatest = std::max(greatest, points[i].order);
  }
  int bits = 0;
  while (bits < 32 && (greatest - least) >> bits > 0) ++bits;
  // Digits of about the same size: few places are written to at once.
  const int passes = (bits + kMostDigitBits - 1) / kMostDigitBits;
  ScreenPoint* to = room.data();
  for (int pass = 0, shift = 0; pass < passes; ++pass) {
    const int digit_bits = (bits * (pass + 1)) / passes - shift;
    sortByDigit(points, count, least, shift, digit_bits, to);
    shift += digit_bits;
    points = to;
    to = points == room.data() ? room.data() + count : room.data();
  }
  return points;
}

}  // namespace afterglow::render
