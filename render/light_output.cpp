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

constexpr auto kAsItIs = [](auto, std::uint8_t value) { return value; };

}  // namespace

LightOutput::LightOutput(const LightSettings& settings, const calib::Lens& lens, bool is_blended)
    : LightOutput(settings, is_blended) {
  if (settings.textures.empty()) return;
  textures_ = std::make_unique<TextureLight>(lens, settings.textures, settings.max_brightness);
}

LightOutput::LightOutput(const LightSettings& settings, bool is_blended)
    : is_identity_(settings.mirror == Mirror::None &&
                   (!settings.colors.empty() || (!settings.gamma && settings.max_brightness >= 1))),
      flips_columns_(settings.mirror == Mirror::Horizontal || settings.mirror == Mirror::Both),
      flips_rows_(settings.mirror == Mirror::Vertical || settings.mirror == Mirror::Both),
      colors_(settings.colors) {
  if (!colors_.empty() && colors_.size() != kColorTableSize) {
    throw std::invalid_argument("a table of colors of another size");
  }
  const auto sent = [&](std::size_t channel, double light) {
    const bool is_srgb = !colors_.empty() || !settings.gamma;
    const double coded =
        is_srgb ? calib::srgbOfLight(light) : std::pow(light, 1 / (*settings.gamma)[channel]);
    return static_cast<std::uint8_t>(std::lround(255 * coded));
  };
  const double white = colors_.empty() ? settings.max_brightness : 1;  // else the table's
  for (std::size_t value = 0; value < 256; ++value) {
    const double light = white * calib::lightOfSrgb(static_cast<double>(value) / 255);
    light_[value] = static_cast<std::uint16_t>(std::lround(PixelLight::kFull * light));
    for (std::size_t channel = 0; channel < 3; ++channel) {
      tables_[channel][value] = sent(channel, light);
    }
  }
  for (std::size_t channel = 0; channel < 3 && is_blended; ++channel) {
    for (int light = 0; light <= PixelLight::kFull; ++light) {
      sent_[channel].push_back(sent(channel, static_cast<double>(light) / PixelLight::kFull));
    }
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
void LightOutput::recolor(std::uint8_t* begin, std::uint8_t* end) const {
  std::array<std::uint8_t, 3> last{}, sent{};
  for (std::uint8_t* pixel = begin; pixel < end; pixel += 3) {
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

void LightOutput::blend(Image& image, const PixelLight& light) const {
  const std::size_t pixels = image.rgb.size() / 3;
  const auto isFor = [&](const auto& list) { return list.empty() || list.size() == pixels; };
  if (sent_[0].empty() || !isFor(light.share) || !isFor(light.raise)) {
    throw std::logic_error("light of other pixels than the image's");
  }
  for (std::size_t i = 0; i < pixels; ++i) {
    std::uint8_t* const pixel = image.rgb.data() + 3 * i;
    const std::uint32_t raise = light.raise.empty() ? 0 : light.raise[i];
    if (raise == 0 && (pixel[0] | pixel[1] | pixel[2]) == 0) continue;
    const std::uint32_t share = light.share.empty() ? PixelLight::kFull : light.share[i];
    for (std::size_t channel = 0; channel < 3; ++channel) {
      // So rounded full light of the full share fits, and is full.
      const std::uint32_t own = (light_[pixel[channel]] * share + PixelLight::kFull) >> 16;
      pixel[channel] = sent_[channel][std::min<std::uint32_t>(own + raise, PixelLight::kFull)];
    }
  }
}

void LightOutput::apply(Image& image, const PixelLight* light) const {
  if (light != nullptr) blend(image, *light);
  if (!colors_.empty()) recolor(image.rgb.data(), image.rgb.data() + image.rgb.size());
  if (light != nullptr) {
    if (flips_columns_ || flips_rows_) mirror(image, kAsItIs);
  } else if (!is_identity_) {
    mirror(image, [this](auto channel, std::uint8_t v) { return tables_[channel][v]; });
  }
}

void LightOutput::apply(Image& image, const std::vector<SurfacePatch>& surfaces,
                        const Rigid<Projector, World>& T_projector_world, const PixelLight* light) {
  if (!textures_) return apply(image, light);
  if (light != nullptr) throw std::logic_error("an image for textures is blended");
  textures_->apply(image, surfaces, T_projector_world,
                   [this](std::uint8_t* begin, std::uint8_t* end) {
                     if (!colors_.empty()) return recolor(begin, end);
                     for (std::uint8_t* pixel = begin; pixel < end; pixel += 3) {
                       for (std::size_t i = 0; i < 3; ++i) pixel[i] = tables_[i][pixel[i]];
                     }
                   });
  if (flips_columns_ || flips_rows_) mirror(image, kAsItIs);
}

std::vector<TextureReport> LightOutput::textureReports() const {
  return textures_ ? textures_->reports() : std::vector<TextureReport>();
}

/// Gives each pixel and its partner their new values, each in the other's place. They may be one
/// and the same.
template <typename Value>
void LightOutput::mirror(Image& image, const Value& value) const {
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
      for (std::size_t channel = 0; channel < 3; ++channel) {
        const std::uint8_t from_a = value(channel, a[channel]);
        a[channel] = value(channel, b[channel]);
        b[channel] = from_a;
      }
      b += flips_columns_ ? -3 : 3;
    }
  }
}

}  // namespace afterglow::render
