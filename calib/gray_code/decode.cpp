#include "calib/gray_code/decode.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace afterglow::calib {
namespace {

/// Below this, in gray levels between black and white, noise decides.
constexpr int kLeastContrast = 8;
/// A stripe's and its inverse's difference, as a share of white less black: less is an edge.
constexpr double kLeastShare = 0.15;
constexpr int kLeastDifference = 3;

int fromGray(int gray) {
  for (int shift = 1; shift < 32; shift <<= 1) gray ^= gray >> shift;
  return gray;
}

constexpr float kUnlit = std::numeric_limits<float>::quiet_NaN();
constexpr float kOutside = std::numeric_limits<float>::infinity();

/// Decodes one axis at one pixel. `first`: its first pair of pictures.
float decodeAxis(const std::vector<Picture>& pictures, std::size_t first, const GrayAxis& axis,
                 std::size_t pixel, int contrast) {
  const int limit = std::max(kLeastDifference, static_cast<int>(kLeastShare * contrast));
  int gray = 0, unsure = 0, unsure_bit = 0;
  for (int bit = axis.bits - 1; bit >= 0; --bit) {
    const std::size_t pair = first + 2 * std::size_t(axis.bits - 1 - bit);
    const int difference =
        int(pictures[pair].pixels[pixel]) - int(pictures[pair + 1].pixels[pixel]);
    if (difference > 0) gray |= 1 << bit;
    if (std::abs(difference) >= limit) continue;
    ++unsure;
    unsure_bit = bit;
  }
  if (unsure > 1) return kUnlit;
  const auto one = axis.middle(fromGray(gray));
  if (unsure == 0) return one ? static_cast<float>(*one) : kOutside;
  const auto other = axis.middle(fromGray(gray ^ (1 << unsure_bit)));
  // Codes beside each other differ in one bit: any other two are a misreading.
  if (!one || !other || std::abs(*one - *other) > 1.01 * axis.step) return kUnlit;
  return static_cast<float>(0.5 * (*one + *other));
}

}  // namespace

DecodedLight decode(const std::vector<Picture>& pictures, const GrayCode& code) {
  const Picture& white = pictures[code.white()];
  const Picture& black = pictures[code.white() + 1];
  const std::size_t columns = code.stripes();
  const std::size_t rows = columns + 2 * std::size_t(code.across.bits);
  DecodedLight light{white.width, white.height, {}};
  light.projector_px.resize(white.pixels.size(), Eigen::Vector2f(kUnlit, kUnlit));
  for (std::size_t i = 0; i < white.pixels.size(); ++i) {
    const int contrast = int(white.pixels[i]) - int(black.pixels[i]);
    if (contrast < kLeastContrast) continue;
    const float x = decodeAxis(pictures, columns, code.across, i, contrast);
    if (std::isnan(x)) continue;
    const float y = decodeAxis(pictures, rows, code.down, i, contrast);
    if (!std::isnan(y)) light.projector_px[i] = Eigen::Vector2f(x, y);
  }
  return light;
}

}  // namespace afterglow::calib
