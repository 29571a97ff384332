#include "render/light_output.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace afterglow::render::light_output_test {
namespace {

/// Every pixel another one; sizes odd and even.
Image numbered(int width, int height) {
  Image image{width, height, {}};
  for (int i = 0; i < width * height; ++i) {
    for (int channel = 0; channel < 3; ++channel) {
      image.rgb.push_back(static_cast<std::uint8_t>(3 * i + channel));
    }
  }
  return image;
}

std::array<int, 3> at(const Image& image, int x, int y) {
  const auto i = static_cast<std::size_t>(3 * (y * image.width + x));
  return {image.rgb[i], image.rgb[i + 1], image.rgb[i + 2]};
}

/// Light of a value that an sRGB screen gives, 0 to 1.
double srgbLight(int value) {
  const double v = value / 255.0;
  return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}

std::array<int, 3> sent(const LightSettings& settings, std::uint8_t value) {
  Image image{1, 1, {value, value, value}};
  LightOutput(settings).apply(image);
  return at(image, 0, 0);
}

TEST(LightOutput, leavesTheImageAloneWhereNothingIsConfigured) {
  Image image = numbered(5, 4);
  LightOutput({}).apply(image);
  EXPECT_EQ(image.rgb, numbered(5, 4).rgb);
}

TEST(LightOutput, mirrorsPixelByPixel) {
  for (const auto& [width, height] : {std::pair{5, 4}, {4, 5}, {1, 1}, {7, 7}}) {
    const Image original = numbered(width, height);
    for (const Mirror mirror : {Mirror::Horizontal, Mirror::Vertical, Mirror::Both}) {
      LightSettings settings;
      settings.mirror = mirror;
      Image image = original;
      LightOutput(settings).apply(image);
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
          const int from_x = mirror == Mirror::Vertical ? x : width - 1 - x;
          const int from_y = mirror == Mirror::Horizontal ? y : height - 1 - y;
          ASSERT_EQ(at(image, x, y), at(original, from_x, from_y))
              << width << "x" << height << " at " << x << ", " << y;
        }
      }
    }
  }
}

TEST(LightOutput, makesAProjectorOfAnyResponseGiveTheLightThatSrgbMeans) {
  LightSettings settings;
  settings.gamma = {{1.8, 2.2, 2.8}};
  for (const int value : {0, 20, 90, 128, 200, 255}) {
    const auto out = sent(settings, static_cast<std::uint8_t>(value));
    for (std::size_t channel = 0; channel < 3; ++channel) {
      // Half a value to either side is what 8 bits can do.
      const auto light = [&](double v) { return std::pow(v / 255, (*settings.gamma)[channel]); };
      const int v = out[channel];
      EXPECT_LE(light(std::max(0.0, v - 0.5)), srgbLight(value) + 1e-12) << value;
      EXPECT_GE(light(v + 0.5), srgbLight(value) - 1e-12) << value;
    }
  }
}

TEST(LightOutput, dimsLightInProportion) {
  LightSettings settings;
  settings.max_brightness = 0.25;
  EXPECT_NEAR(srgbLight(sent(settings, 255)[0]), 0.25, 0.002);
  EXPECT_NEAR(srgbLight(sent(settings, 128)[1]), 0.25 * srgbLight(128), 0.002);
  EXPECT_EQ(sent(settings, 0), (std::array<int, 3>{0, 0, 0}));
  settings.max_brightness = 0;
  EXPECT_EQ(sent(settings, 255), (std::array<int, 3>{0, 0, 0}));
  settings.max_brightness = 0.5;
  settings.gamma = {{1, 1, 1}};
  EXPECT_EQ(sent(settings, 255)[2], 128);
}

/// Red and blue exchanged, green at half.
std::vector<std::uint8_t> exchanging() {
  std::vector<std::uint8_t> table;
  const auto at = [](int step) {
    return static_cast<std::uint8_t>(std::lround(step * 255 / 32.0));
  };
  for (int b = 0; b <= 32; ++b) {
    for (int g = 0; g <= 32; ++g) {
      for (int r = 0; r <= 32; ++r) {
        table.insert(table.end(), {at(b), static_cast<std::uint8_t>(at(g) / 2), at(r)});
      }
    }
  }
  return table;
}

TEST(LightOutput, sendsWhatTheTableHasForAColor) {
  LightSettings settings;
  settings.colors = exchanging();
  const LightOutput output(settings);
  std::vector<std::uint8_t> drawn = {0, 0, 0};
  for (int i = 0; i < 3000; ++i) drawn.push_back(static_cast<std::uint8_t>(i * i / 7));
  Image image{1001, 1, drawn};
  output.apply(image);
  EXPECT_EQ(at(image, 0, 0), (std::array<int, 3>{0, 0, 0}));
  for (int x = 0; x < 1001; ++x) {
    const auto i = static_cast<std::size_t>(3 * x);
    const auto out = at(image, x, 0);
    EXPECT_NEAR(out[0], drawn[i + 2], 1) << x;
    EXPECT_NEAR(out[1], drawn[i + 1] / 2, 1) << x;
    EXPECT_NEAR(out[2], drawn[i], 1) << x;
  }
  settings.mirror = Mirror::Horizontal;
  Image mirrored{1001, 1, drawn};
  LightOutput(settings).apply(mirrored);
  EXPECT_EQ(at(mirrored, 1000, 0), at(image, 0, 0));
  EXPECT_EQ(at(mirrored, 3, 0), at(image, 997, 0));
  settings.colors.pop_back();
  EXPECT_THROW(LightOutput{settings}, std::invalid_argument);
}

TEST(LightOutput, givesEachPixelItsShareInLight) {
  for (const bool has_gamma : {false, true}) {
    LightSettings settings;
    settings.max_brightness = 0.8;
    if (has_gamma) settings.gamma = {{1.8, 2.2, 2.8}};
    Image image{3, 1, {0, 90, 255, 0, 90, 255, 0, 90, 255}};
    const PixelLight light{{65535, 32768, 6554}, {}};
    LightOutput(settings, true).apply(image, &light);
    for (int x = 0; x < 3; ++x) {
      const double share = 0.8 * std::array<double, 3>{1, 0.5, 0.1}[static_cast<std::size_t>(x)];
      const auto sent = [&](std::size_t channel, double v) {
        return has_gamma ? std::pow(v / 255, (*settings.gamma)[channel])
                         : srgbLight(static_cast<int>(v));
      };
      EXPECT_EQ(at(image, x, 0)[0], 0);
      EXPECT_NEAR(sent(1, at(image, x, 0)[1]), share * srgbLight(90), 0.0025) << x;
      EXPECT_NEAR(sent(2, at(image, x, 0)[2]), share, 0.008) << x;
    }
  }
}

TEST(LightOutput, raisesBlackAndMirrorsBehindIt) {
  LightSettings settings;
  settings.mirror = Mirror::Horizontal;
  const LightOutput output(settings, true);
  Image image{2, 1, {0, 0, 0, 255, 255, 255}};
  const PixelLight light{{}, {6554, 6554}};
  output.apply(image, &light);
  EXPECT_EQ(at(image, 0, 0)[0], 255);
  EXPECT_NEAR(srgbLight(at(image, 1, 0)[0]), 0.1, 0.004);
  Image full{2, 1, {1, 20, 200, 255, 128, 0}};
  output.apply(full, nullptr);
  EXPECT_EQ(at(full, 1, 0), (std::array<int, 3>{1, 20, 200}));
  const PixelLight all;
  output.apply(full, &all);
  EXPECT_EQ(at(full, 0, 0), (std::array<int, 3>{1, 20, 200}));
}

TEST(LightOutput, takesTheLightOfItsOwnPixelsOnly) {
  Image image{2, 1, {0, 0, 0, 255, 255, 255}};
  const PixelLight light{{1, 2, 3}, {}};
  EXPECT_THROW(LightOutput({}, true).apply(image, &light), std::logic_error);
  const PixelLight fitting{{1, 2}, {}};
  EXPECT_THROW(LightOutput(LightSettings{}).apply(image, &fitting), std::logic_error);
}

TEST(LightOutput, mapsAndMirrorsEveryPixelOnce) {
  LightSettings settings;
  settings.mirror = Mirror::Both;
  settings.max_brightness = 0.5;
  settings.gamma = {{1, 1, 1}};
  Image image{3, 3, std::vector<std::uint8_t>(27, 255)};
  LightOutput(settings).apply(image);
  EXPECT_EQ(image.rgb, std::vector<std::uint8_t>(27, 128));
}

}  // namespace
}  // namespace afterglow::render::light_output_test
