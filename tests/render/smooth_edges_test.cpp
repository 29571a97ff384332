#include "render/scene/image.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>

namespace afterglow::render::smooth_edges_test {
namespace {

/// Gray by place.
template <typename Tone>
Image imageOf(int width, int height, const Tone& tone) {
  Image image{width, height, {}};
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      image.rgb.insert(image.rgb.end(), 3, static_cast<std::uint8_t>(tone(u, v)));
    }
  }
  return image;
}

int toneAt(const Image& image, int u, int v) {
  return image.rgb[3 * static_cast<std::size_t>(v * image.width + u)];
}

TEST(SmoothEdges, leavesWhatHasNoEdgeAsItIs) {
  const Image faint = imageOf(40, 30, [](int u, int v) { return 100 + (u + v) % 4; });
  Image image = faint;
  smoothEdges(image);
  EXPECT_EQ(image.rgb, faint.rgb);
}

TEST(SmoothEdges, fillsTheStepsOfAStairAndKeepsItsBrightness) {
  const Image stair = imageOf(60, 60, [](int u, int v) { return u > 2 * v - 30 ? 200 : 40; });
  Image image = stair;
  smoothEdges(image);
  int between = 0, before = 0, after = 0;
  for (int v = 20; v < 40; ++v) {
    for (int u = 1; u < 59; ++u) {
      const int tone = toneAt(image, u, v);
      EXPECT_GE(tone, 40);
      EXPECT_LE(tone, 200);
      between += tone > 60 && tone < 180 ? 1 : 0;
      before += toneAt(stair, u, v), after += tone;
    }
  }
  EXPECT_GT(between, 20) << "one a row, at least";
  EXPECT_NEAR(static_cast<double>(after) / before, 1, 0.02);
  EXPECT_EQ(toneAt(image, 5, 30), 40) << "far from the edge";
}

TEST(SmoothEdges, takesImagesThatAreTooSmallForEdges) {
  Image image = imageOf(2, 5, [](int u, int) { return 255 * u; });
  const Image before = image;
  smoothEdges(image);
  EXPECT_EQ(image.rgb, before.rgb);
  Image none;
  EXPECT_NO_THROW(smoothEdges(none));
}

}  // namespace
}  // namespace afterglow::render::smooth_edges_test
