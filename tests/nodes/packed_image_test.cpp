#include <gtest/gtest.h>

#include "nodes/observer/shot.hpp"

namespace afterglow::nodes::packed_image_test {
namespace {

TEST(PackedImage, comesOutAsItWentIn) {
  render::Image image{3, 2, {0, 0, 0, 0, 0, 0, 9, 9, 9, 9, 9, 8, 0, 0, 0, 0, 0, 0}};
  const render::Image out = PackedImage(image).unpacked();
  EXPECT_EQ(out.width, 3);
  EXPECT_EQ(out.height, 2);
  EXPECT_EQ(out.rgb, image.rgb);
  EXPECT_TRUE(PackedImage().unpacked().rgb.empty());
}

}  // namespace
}  // namespace afterglow::nodes::packed_image_test
