#include "render/light_output.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>

#include "calib/color/color.hpp"

namespace afterglow::render {
namespace {

using calib::kColorTableSide;
constexpr std::size_t kColorTableSize = 3ul * kColorTableSide * kColorTableSide * kColorTableSide;

/// The place of a value in the table: behind how many steps, and how far into the next, of 256.
struct TablePlace {
  std::uint32_t cell = 0, share = 0;
};
constexpr std::array<TablePlace, 256> tablePlaces() {
  constexpr std::uint32_t kSteps = kColorTableSide - 1;
  std::array<TablePlace, 256> places{};
  for (std::uint32_t value = 0; value < 256; ++value) {
    const std::uint32_t cell = value < 255 ? value * kSteps / 255 : kSteps - 1;
    places[value].cell = cell;
    places[value].share = ((value * kSteps - 255 * cell) * 256 + 127) / 255;
  }
  return places;
}
constexpr std::array<TablePlace, 256> kTablePlaces = tablePlaces();

}  // namespace

LightOutput::LightOutput(const LightSettings& settings)
    : is_identity_(settings.mirror == Mirror::None &&
                   (!settings.colors.empty() ||
                    (!settings.gamma && settings.max_brightness >= 1))),
      flips_columns_(settings.mirror == Mirror::Horizontal || settings.mirror == Mirror::Both),
      flips_rows_(settings.mirror == Mirror::Vertical || settings.mirror == Mirror::Both),
      colors_(settings.colors) {
  if (!colors_.empty() && colors_.size() != kColorTableSize) {
    throw std::invalid_argument("a table of colors of another size");
  }
  for (std::size_t channel = 0; channel < 3; ++channel) {
    for (std::size_t value = 0; value < 256; ++value) {
      const double coded = static_cast<double>(value) / 255;
      const double light = settings.max_brightness * calib::lightOfSrgb(coded);
      const double sent = !colors_.empty()  ? coded
                          : settings.gamma ? std::pow(light, 1 / (*settings.gamma)[channel])
                                           : calib::srgbOfLight(light);
      tables_[channel][value] = static_cast<std::uint8_t>(std::lround(255 * sent));
    }
  }
}

void LightOutput::exchange(std::uint8_t* a, std::uint8_t* b) const {
  for (std::size_t channel = 0; channel < 3; ++channel) {
    const std::uint8_t from_a = tables_[channel][a[channel]];
    a[channel] = tables_[channel][b[channel]];
    b[channel] = from_a;
  }
}

void LightOutput::recolor(std::uint8_t* pixel) const {
  constexpr std::uint32_t kGreen = 3 * kColorTableSide, kBlue = kGreen * kColorTableSide;
  const TablePlace r = kTablePlaces[pixel[0]], g = kTablePlaces[pixel[1]],
                   b = kTablePlaces[pixel[2]];
  const std::uint8_t* const corner = colors_.data() + 3 * r.cell + kGreen * g.cell + kBlue * b.cell;
  const std::uint32_t near_r = 256 - r.share, near_g = 256 - g.share, near_b = 256 - b.share;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto along = [&](std::uint32_t at) {
      return corner[at + i] * near_r + corner[at + i + 3] * r.share;
    };
    const std::uint32_t front = along(0) * near_g + along(kGreen) * g.share;
    const std::uint32_t back = along(kBlue) * near_g + along(kBlue + kGreen) * g.share;
    // 255 times 256 to the third power, and a half, fit.
    pixel[i] = static_cast<std::uint8_t>((front * near_b + back * b.share + (1u << 23)) >> 24);
  }
}

/// Most of a picture is black, and what is lit has few colors, side by side.
void LightOutput::recolor(Image& image) const {
  std::array<std::uint8_t, 3> last{}, sent{};
  for (std::size_t i = 0; i + 2 < image.rgb.size(); i += 3) {
    std::uint8_t* const pixel = image.rgb.data() + i;
    if ((pixel[0] | pixel[1] | pixel[2]) == 0) continue;
    if (pixel[0] != last[0] || pixel[1] != last[1] || pixel[2] != last[2]) {
      std::copy_n(pixel, 3, last.begin());
      recolor(pixel);
      std::copy_n(pixel, 3, sent.begin());
    } else {
      std::copy_n(sent.begin(), 3, pixel);
    }
  }
}

void LightOutput::apply(Image& image) const {
  if (!colors_.empty()) recolor(image);
  if (is_identity_) return;
  const int width = image.width, height = image.height;
  const auto pixel = [&image, width](int x, int y) {
    return image.rgb.data() + 3 * (static_cast<std::ptrdiff_t>(y) * width + x);
  };
  for (int y = 0; y < height; ++y) {
    const int partner_y = flips_rows_ ? height - 1 - y : y;
    if (partner_y < y) break;  // done with its partner
    const bool is_own = partner_y == y;
    const int end = is_own && flips_columns_ ? (width + 1) / 2 : width;
    std::uint8_t* b = pixel(flips_columns_ ? width - 1 : 0, partner_y);
    for (std::uint8_t *a = pixel(0, y), *a_end = a + 3 * end; a < a_end; a += 3) {
      exchange(a, b);
      b += flips_columns_ ? -3 : 3;
    }
  }
}

}  // namespace afterglow::render
