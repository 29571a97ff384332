#include "render/light_output.hpp"

#include <cmath>
#include <cstddef>

namespace afterglow::render {
namespace {

/// IEC 61966-2-1: the light that a value stands for, and back.
double fromSrgb(double value) {
  return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}
double toSrgb(double light) {
  return light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1 / 2.4) - 0.055;
}

}  // namespace

LightOutput::LightOutput(const LightSettings& settings)
    : is_identity_(!settings.gamma && settings.max_brightness >= 1 &&
                   settings.mirror == Mirror::None),
      flips_columns_(settings.mirror == Mirror::Horizontal || settings.mirror == Mirror::Both),
      flips_rows_(settings.mirror == Mirror::Vertical || settings.mirror == Mirror::Both) {
  for (std::size_t channel = 0; channel < 3; ++channel) {
    for (std::size_t value = 0; value < 256; ++value) {
      const double light = settings.max_brightness * fromSrgb(static_cast<double>(value) / 255);
      const double sent =
          settings.gamma ? std::pow(light, 1 / (*settings.gamma)[channel]) : toSrgb(light);
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

void LightOutput::apply(Image& image) const {
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
