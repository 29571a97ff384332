// Which back end draws an image, by what each took for few points and for many.
#include "render/projector_renderer.hpp"

#include <gtest/gtest.h>

namespace afterglow::render::drawing_choice_test {
namespace {

TEST(DrawingChoice, takesWhoeverIsFasterForAsMuchAsThereIsToDraw) {
  // As measured on a GPU: it has to send each image, however little there is in it.
  const DrawingChoice choice{{0.5, 4.6}, {1.0, 1.6}};
  EXPECT_FALSE(choice.isForGl(0, false));
  EXPECT_FALSE(choice.isForGl(DrawingPace::kFew, false));
  EXPECT_TRUE(choice.isForGl(DrawingPace::kMany, false));
  EXPECT_TRUE(choice.isForGl(1'000'000, false));
  EXPECT_NE(choice.text().find("OpenGL where there is much"), std::string::npos) << choice.text();
}

TEST(DrawingChoice, staysWithWhoDrewTheLastImageWhereBothAreAboutAsFast) {
  const DrawingChoice choice{{1, 5}, {1.1, 4.9}};
  for (const bool was_gl : {false, true}) {
    for (const std::size_t points : {std::size_t{0}, DrawingPace::kFew, DrawingPace::kMany}) {
      EXPECT_EQ(choice.isForGl(points, was_gl), was_gl) << points;
    }
  }
}

TEST(DrawingChoice, countsPointsAndCorners) {
  PointCloud cloud;
  cloud.points = PointList(1000, Eigen::Vector3f::Zero());
  Layer layer;
  layer.drawables = {{{}, cloud, {}}, {{}, Cube{}, {}}};
  EXPECT_EQ(pointsOf({{layer, layer}}), 2016u);
}

}  // namespace
}  // namespace afterglow::render::drawing_choice_test
