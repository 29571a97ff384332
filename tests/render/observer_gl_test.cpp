// The bystander's image: projected light appears where geometry says, and only where the
// projector can be seen.
#include <gtest/gtest.h>

#include "render/gl/observer_renderer.hpp"
#include "tests/support/gl_context.hpp"
#include "tests/support/image_measures.hpp"
#include "tests/support/optics.hpp"

namespace afterglow::render::observer_gl_test {
namespace {

Rigid<World, World> at(double x, double y, double z) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() << x, y, z;
  return Rigid<World, World>(T);
}

class Observed : public test::GlTest {
 protected:
  void SetUp() override {
    GlTest::SetUp();
    view_.width = 640;
    view_.height = 360;
    view_.T_world_observer = test::lookAt<Observer>({0.5, -2.5, 1.6}, {1.3, 0, 0.1});
    room_ = {{at(1, 0, -0.05), Cube{{6, 6, 0.1f}}, {0.6f, 0.6f, 0.6f, 1}}};
  }

  /// Light for a white square on the floor, thrown through a lens that bends.
  ProjectedLight lightForSquare(double x, double y, float size) {
    Layer layer;
    layer.drawables = {{at(x, y, 0), Cube{{size, size, 0.0002f}}, {}}};
    const auto T = T_world_projector_.inverse();
    return {lens_, T, ProjectorRenderer(context(), lens_).render({{layer}}, T)};
  }

  Image observe(const ProjectedLight* light) {
    return ObserverRenderer(context()).render(room_, light, view_);
  }

  /// Pixel of a world point in the bystander's image.
  Eigen::Vector2d pixel(const Eigen::Vector3d& p_world) const {
    const Eigen::Vector3d p = view_.T_world_observer.inverse() * p_world;
    const double f = view_.height / 2.0 / std::tan(view_.vertical_fov / 2);
    return Eigen::Vector2d(view_.width - 1, view_.height - 1) / 2 + f * p.head<2>() / p.z();
  }

  int brightnessAt(const Image& image, const Eigen::Vector3d& p_world) const {
    const Eigen::Vector2d p = pixel(p_world);
    return test::brightness(image, static_cast<int>(std::lround(p.x())),
                            static_cast<int>(std::lround(p.y())));
  }

  /// Center of where two images differ by more than a beam in the air, and over how many pixels.
  static std::pair<Eigen::Vector2d, double> difference(const Image& a, const Image& b) {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    double weight = 0, count = 0;
    for (int v = 0; v < a.height; ++v) {
      for (int u = 0; u < a.width; ++u) {
        const int change = std::abs(test::brightness(a, u, v) - test::brightness(b, u, v));
        if (change < 100) continue;
        sum += change * Eigen::Vector2d(u, v);
        weight += change;
        ++count;
      }
    }
    return {sum / std::max(weight, 1.0), count};
  }

  calib::Lens lens_ = test::lens(1280, 800, 1100, 640, 500, {-0.25, 0.05, 0.001, -0.001, 0});
  const Rigid<World, Projector> T_world_projector_ =
      test::lookAt<Projector>({0, 0, 1.5}, {1.3, 0, 0});
  std::vector<Drawable> room_;
  ObserverView view_;
};

TEST_F(Observed, projectedSquareLiesWhereGeometrySays) {
  const ProjectedLight light = lightForSquare(1.3, 0.2, 0.2f);
  const auto [center, count] = difference(observe(&light), observe(nullptr));
  EXPECT_LT((center - pixel({1.3, 0.2, 0})).norm(), 1.0);
  // Its outline's area, by the shoelace formula.
  double area = 0;
  const double h = 0.1;
  const Eigen::Vector2d corners[] = {pixel({1.3 - h, 0.2 - h, 0}), pixel({1.3 + h, 0.2 - h, 0}),
                                     pixel({1.3 + h, 0.2 + h, 0}), pixel({1.3 - h, 0.2 + h, 0})};
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector2d &a = corners[i], &b = corners[(i + 1) % 4];
    area += (a.x() * b.y() - a.y() * b.x()) / 2;
  }
  EXPECT_NEAR(count / std::abs(area), 1, 0.2) << "softened edges count, too";
}

TEST_F(Observed, aFisheyesLightLiesThereToo) {
  lens_ = test::fisheye(1280, 800, 500, 640, 500, {-0.03, 0.01, -0.004, 0.0005});
  const ProjectedLight light = lightForSquare(1.5, 0.3, 0.2f);
  EXPECT_LT((difference(observe(&light), observe(nullptr)).first - pixel({1.5, 0.3, 0})).norm(), 1);
}

TEST_F(Observed, lightIsClearlyVisibleInTheDimmedRoom) {
  const ProjectedLight light = lightForSquare(1.3, 0.2, 0.2f);
  const Image lit = observe(&light), dark = observe(nullptr);
  const Eigen::Vector2d at_square = pixel({1.3, 0.2, 0});
  const int u = static_cast<int>(at_square.x()), v = static_cast<int>(at_square.y());
  EXPECT_GT(test::brightness(lit, u, v), test::brightness(dark, u, v) + 200);
  EXPECT_GT(test::brightness(dark, u, v), 40) << "the room is darkened, not black";
}

TEST_F(Observed, aBoxInTheBeamTakesTheLight) {
  const ProjectedLight light = lightForSquare(1.6, 0, 0.2f);
  // Half-way between projector and square, out of the bystander's sight of the square.
  room_.push_back({at(0.8, 0, 0.75), Cube{Eigen::Vector3f::Constant(0.3f)}, {}});
  const Image lit = observe(&light), dark = observe(nullptr);
  const Eigen::Vector2d at_square = pixel({1.6, 0, 0});
  const int u = static_cast<int>(at_square.x()), v = static_cast<int>(at_square.y());
  EXPECT_EQ(test::brightness(lit, u, v), test::brightness(dark, u, v));
  const auto [center, count] = difference(lit, dark);
  EXPECT_LT((center - pixel({0.72, 0, 0.85})).norm(), 40) << "it lies on the box instead";
  EXPECT_GT(count, 20);
}

TEST_F(Observed, surfacesDoNotShadeThemselves) {
  // All white: every floor pixel in the beam must be lit, without stripes or holes.
  ProjectedLight light{lens_, T_world_projector_.inverse(), {1280, 800, {}}};
  light.image.rgb.assign(3 * 1280 * 800, 255);
  const Image lit = observe(&light), dark = observe(nullptr);
  int holes = 0, inside = 0;
  for (double x = 0.8; x < 2.4; x += 0.02) {
    for (double y = -0.3; y < 0.3; y += 0.02) {
      const Eigen::Vector2d p = pixel({x, y, 0});
      const int u = static_cast<int>(std::lround(p.x())), v = static_cast<int>(std::lround(p.y()));
      if (u < 0 || v < 0 || u >= view_.width || v >= view_.height) continue;
      ++inside;
      holes += test::brightness(lit, u, v) < test::brightness(dark, u, v) + 60;
    }
  }
  EXPECT_GT(inside, 1000);
  EXPECT_EQ(holes, 0);
}

TEST_F(Observed, aShadowFallsWhereTheLampIsHidden) {
  const Image empty = observe(nullptr);
  room_.push_back({at(1.3, 0, 0.5), Cube{Eigen::Vector3f::Constant(0.3f)}, {}});
  const Image shaded = observe(nullptr);
  const Eigen::Vector3d p_shadow(1.594, -0.071, 0), p_beside(0.6, -0.4, 0);
  EXPECT_LT(brightnessAt(shaded, p_shadow), 0.8 * brightnessAt(empty, p_shadow));
  EXPECT_NEAR(brightnessAt(shaded, p_beside), brightnessAt(empty, p_beside), 6);
}

TEST_F(Observed, whatStandsDarkensTheFloorAtItsFoot) {
  const Image empty = observe(nullptr);
  room_.push_back({at(1.3, 0, 0.15), Cube{Eigen::Vector3f::Constant(0.3f)}, {}});
  const Image standing = observe(nullptr);
  const Eigen::Vector3d p_foot(1.135, -0.05, 0), p_beside(0.6, 0, 0);  // the lamp's side of it
  EXPECT_LT(brightnessAt(standing, p_foot), 0.96 * brightnessAt(empty, p_foot));
  EXPECT_NEAR(brightnessAt(standing, p_beside), brightnessAt(empty, p_beside), 6);
}

TEST_F(Observed, strongOrangeLightStaysOrange) {
  ProjectedLight light{lens_, T_world_projector_.inverse(), {1280, 800, {}}};
  for (int i = 0; i < 1280 * 800; ++i) light.image.rgb.insert(light.image.rgb.end(), {206, 92, 0});
  const Image lit = observe(&light);
  const Eigen::Vector2d p = pixel({1.3, 0, 0});
  const auto* rgb = &lit.rgb[3 * (static_cast<std::size_t>(std::lround(p.y())) * 640 +
                                  static_cast<std::size_t>(std::lround(p.x())))];
  EXPECT_GT(rgb[0], 160);
  EXPECT_NEAR(rgb[1] / 255.0, 0.5 * rgb[0] / 255.0, 0.1);
  EXPECT_LT(rgb[2], rgb[0] / 2) << "pink";
}

TEST_F(Observed, whatIsGoneIsGrayAndStandsInNobodysLight) {
  const Image empty = observe(nullptr);
  room_.push_back({at(1.3, 0, 0.15), Cube{Eigen::Vector3f::Constant(0.3f)}, {1, 1, 1, 0.3f}});
  const Image gone = observe(nullptr);
  const auto change = [&](double x, double y, double z) {
    return brightnessAt(gone, {x, y, z}) - brightnessAt(empty, {x, y, z});
  };
  for (const double z : {0.3, 0.15}) {
    EXPECT_GT(change(1.3, -0.15, z), 40);
    EXPECT_LT(change(1.3, -0.15, z), 180) << "light is brighter";
  }
  EXPECT_EQ(change(1.55, -0.02, 0), 0) << "no shadow";
}

TEST_F(Observed, theBeamIsFaintlySeenInTheAir) {
  const ProjectedLight light = lightForSquare(1.3, 0, 0.3f);
  const Image lit = observe(&light), dark = observe(nullptr);
  const Eigen::Vector3d p_beam(0.5, 0, 0.92), p_beside(0.5, 0, 0.4);  // on the way to the square
  EXPECT_GT(brightnessAt(lit, p_beam), brightnessAt(dark, p_beam));
  EXPECT_LT(brightnessAt(lit, p_beam), brightnessAt(dark, p_beam) + 150);
  EXPECT_NEAR(brightnessAt(lit, p_beside), brightnessAt(dark, p_beside), 3);
}

TEST_F(Observed, whatHasChangedIsDrawnAnewAndTheRestAsItWas) {
  ObserverRenderer renderer(context());
  const ProjectedLight light = lightForSquare(1.3, 0.2, 0.3f);
  const Image first = renderer.render(room_, &light, view_);
  const auto looksAsFirst = [&](const std::vector<Drawable>& room, const ProjectedLight* thrown,
                                const ObserverView& view) {
    return renderer.render(room, thrown, view).rgb == first.rgb;
  };
  EXPECT_TRUE(looksAsFirst(room_, &light, view_));
  EXPECT_FALSE(looksAsFirst(room_, nullptr, view_));
  std::vector<Drawable> more = room_;
  more.push_back({at(1.3, -0.3, 0.1), Cube{{0.2f, 0.2f, 0.2f}}, {}});
  EXPECT_FALSE(looksAsFirst(more, &light, view_));
  ObserverView closer = view_;
  closer.vertical_fov *= 0.9;
  EXPECT_FALSE(looksAsFirst(room_, &light, closer));
  EXPECT_TRUE(looksAsFirst(room_, &light, view_));
  const ProjectedLight other = lightForSquare(1.3, 0.2, 0.2f);
  EXPECT_FALSE(looksAsFirst(room_, &other, view_));
}

TEST_F(Observed, aDarkImageChangesNothing) {
  ProjectedLight light{lens_, T_world_projector_.inverse(), {1280, 800, {}}};
  light.image.rgb.assign(3 * 1280 * 800, 0);
  EXPECT_EQ(observe(&light).rgb, observe(nullptr).rgb);
}

TEST_F(Observed, refusesAnImageThatIsNotTheLenss) {
  ProjectedLight light{lens_, T_world_projector_.inverse(), {4, 4, {}}};
  light.image.rgb.assign(48, 255);
  EXPECT_THROW(observe(&light), std::logic_error);
  view_.vertical_fov = 0;
  EXPECT_THROW(observe(nullptr), std::logic_error);
}

}  // namespace
}  // namespace afterglow::render::observer_gl_test
