#include "render/light_blend.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "render/scene/relief.hpp"
#include "tests/support/optics.hpp"

namespace afterglow::render::light_blend_test {
namespace {

using Poses = std::vector<std::optional<Rigid<Projector, World>>>;

Rigid<World, Surface> at(double x, double y, double z) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() << x, y, z;
  return Rigid<World, Surface>(T);
}

const SurfacePatch kFloor{"floor", at(0, 0, 0), {}};
const SurfacePatch kTable{
    "table", at(0, 0, 0.7), {{-0.3, -0.3}, {0.3, -0.3}, {0.3, 0.3}, {-0.3, 0.3}}};

std::optional<Rigid<Projector, World>> looking(const Eigen::Vector3d& from,
                                               const Eigen::Vector3d& to) {
  return test::lookAt<Projector>(from, to, Eigen::Vector3d::UnitY()).inverse();
}

struct Seen {
  double share = 0, raise = 0;  ///< 0 to 1
  bool is_lit = false;
};

/// The light that a projector gives to a point, by OpenCV's lens.
Seen seenAt(const LightBlend& blend, std::size_t i, const calib::Lens& lens,
            const Rigid<Projector, World>& T, const Eigen::Vector3d& p_world) {
  const Eigen::Vector3d p = T.matrix() * p_world;
  if (p.z() <= 0) return {};
  const Eigen::Vector2d pixel = test::projectWithOpenCv(lens, {p})[0];
  if (!(pixel.x() > -0.5 && pixel.x() < lens.width - 0.5 && pixel.y() > -0.5 &&
        pixel.y() < lens.height - 0.5)) {
    return {};
  }
  const double u = std::clamp(pixel.x(), 0.0, lens.width - 1.001);
  const double v = std::clamp(pixel.y(), 0.0, lens.height - 1.001);
  const auto between = [&](const std::vector<std::uint16_t>& list) {
    if (list.empty()) return 0.0;
    double sum = 0;
    for (int k = 0; k < 4; ++k) {
      const int x = static_cast<int>(u) + k % 2, y = static_cast<int>(v) + k / 2;
      sum += (1 - std::abs(u - x)) * (1 - std::abs(v - y)) *
             list[static_cast<std::size_t>(y * lens.width + x)];
    }
    return sum / PixelLight::kFull;
  };
  return {between(blend.light(i).share), between(blend.light(i).raise), true};
}

const calib::Lens kBent =
    test::lens(640, 400, 520, 325, 210, {-0.19, 0.06, 0.0012, -0.0008, -0.01});
const calib::Lens kFine = test::lens(1000, 563, 760, 500, 300, {-0.06, 0.02, 0.0008, 0.0005, 0});
const calib::Lens kFisheye = test::fisheye(600, 600, 260, 300, 300, {0.01, -0.002, 0, 0});

TEST(LightBlend, sharesOfAPlaceAddUpToOne) {
  const std::vector<calib::Lens> lenses = {kBent, kFine, kFisheye};
  const Poses poses = {looking({-1.2, 0, 2.2}, {-0.6, 0, 0}), looking({1.4, 0.3, 2.4}, {0.5, 0, 0}),
                       looking({0.1, -1, 1.8}, {0, 0.1, 0})};
  LightBlend blend({{kBent}, {kFine}, {kFisheye}}, false);
  blend.update({kFloor}, poses);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> x(-1.5, 1.5), y(-1, 1);
  int shared = 0;
  for (int k = 0; k < 3000; ++k) {
    const Eigen::Vector3d p(x(random), y(random), 0);
    double sum = 0;
    int lit = 0;
    for (std::size_t i = 0; i < lenses.size(); ++i) {
      const Seen seen = seenAt(blend, i, lenses[i], *poses[i], p);
      sum += seen.share;
      lit += seen.is_lit;
    }
    shared += lit > 1;
    EXPECT_NEAR(sum, lit > 0 ? 1 : 0, 0.02) << p.transpose();
  }
  EXPECT_GT(shared, 1000);
  EXPECT_GT(blend.summary(0).shared, 0.3);
  EXPECT_EQ(blend.summary(0).dimmed, 1);
}

TEST(LightBlend, aPlaceHasLessOfAProjectorTheNearerItsImageEnds) {
  LightBlend blend({{kBent}, {kFine}}, false);
  const Poses poses = {looking({-0.7, 0, 2.2}, {-0.7, 0, 0}), looking({0.7, 0, 2.2}, {0.7, 0, 0})};
  blend.update({kFloor}, poses);
  double before = 1;
  for (double x = -0.9; x < 0.9; x += 0.02) {
    const double share = seenAt(blend, 0, kBent, *poses[0], {x, 0, 0}).share;
    EXPECT_LE(share, before + 1e-3) << x;
    EXPECT_GT(share, before - 0.1) << x;
    before = share;
  }
  EXPECT_LT(before, 0.05);
}

TEST(LightBlend, aProjectorThatIsDarkLeavesItsShareToTheOthers) {
  LightBlend blend({{kBent}, {kBent}}, false);
  const auto pose = looking({0, 0, 2}, {0, 0, 0});
  blend.update({kFloor}, {pose, pose});
  const std::size_t middle = 200 * 640 + 320;
  EXPECT_NEAR(blend.light(0).share[middle], PixelLight::kFull / 2, 2);
  EXPECT_EQ(blend.summary(0).shared, 1);
  blend.update({kFloor}, {pose, std::nullopt});
  EXPECT_EQ(blend.light(0).share[middle], PixelLight::kFull);
  EXPECT_EQ(blend.summary(0).shared, 0);
  EXPECT_TRUE(blend.light(1).share.empty());
}

TEST(LightBlend, whereNoSurfaceIsKnownEachHasItsOwnLight) {
  LightBlend blend({{kBent}, {kBent}}, false);
  const auto down = looking({0, 0, 2}, {0, 0, 0});
  blend.update({kTable}, {down, down});
  EXPECT_NEAR(blend.light(0).share[210 * 640 + 325], PixelLight::kFull / 2, 2);
  EXPECT_EQ(blend.light(0).share[0], PixelLight::kFull);
  blend.update({}, {down, down});
  EXPECT_EQ(blend.light(0).share[210 * 640 + 325], PixelLight::kFull);
}

TEST(LightBlend, theShadowOfATableIsLeftToWhoSeesBehindItWithoutAStep) {
  LightBlend blend({{kBent}, {kFine}}, false);
  const Poses poses = {looking({-1.2, 0, 2.2}, {0, 0, 0}), looking({1.2, 0, 2.2}, {0, 0, 0})};
  blend.update({kFloor, kTable}, poses);
  // The second one's shadow of the table lies to the left of it.
  const auto share = [&](double x) { return seenAt(blend, 0, kBent, *poses[0], {x, 0, 0}).share; };
  EXPECT_NEAR(share(-0.7), 1, 1e-3);
  double before = share(-1.3);
  for (double x = -1.3; x < -0.68; x += 0.005) {
    EXPECT_LT(std::abs(share(x) - before), 0.12) << x;
    before = share(x);
  }
}

TEST(LightBlend, placesOnAReliefAreSharedAtTheirHeight) {
  constexpr int kNodes = 101;
  std::vector<float> heights;
  for (int i = 0; i < kNodes * kNodes; ++i) {
    heights.push_back(0.2f + 0.05f * std::sin(0.1f * static_cast<float>(i % kNodes)));
  }
  SurfacePatch hill = kFloor;
  const auto relief =
      std::make_shared<Relief>(Eigen::Vector2d(-1, -1), 0.02, kNodes, kNodes, heights);
  hill.relief = relief;
  LightBlend blend({{kBent}, {kFine}}, false);
  const Poses poses = {looking({-0.9, 0, 2.2}, {-0.4, 0, 0}), looking({1, 0, 2.2}, {0.4, 0, 0})};
  blend.update({hill}, poses);
  for (double x = -0.5; x < 0.5; x += 0.03) {
    const Eigen::Vector3d p(x, 0.2, relief->height({x, 0.2}).value());
    const double left = seenAt(blend, 0, kBent, *poses[0], p).share;
    const double right = seenAt(blend, 1, kFine, *poses[1], p).share;
    EXPECT_NEAR(left + right, 1, 0.02) << x;
  }
}

TEST(LightBlend, knownFluxesAreEvenedToTheDarkestPlaceThatSeveralLight) {
  // Straight down from one height: light is a projector's flux by its image's area, everywhere.
  const calib::Lens lens = test::lens(640, 400, 520, 319.5, 199.5);
  const Poses poses = {looking({-0.7, 0, 2}, {-0.7, 0, 0}), looking({0.7, 0, 2}, {0.7, 0, 0})};
  LightBlend blend({{lens, 1000}, {lens, 3000, 0.5}}, false);
  blend.update({kFloor}, poses);
  const auto light = [&](double x) {
    return seenAt(blend, 0, lens, *poses[0], {x, 0, 0}).share +
           1.5 * seenAt(blend, 1, lens, *poses[1], {x, 0, 0}).share;
  };
  for (double x = -1.8; x < 1.8; x += 0.05) EXPECT_NEAR(light(x), 1, 0.02) << x;
  EXPECT_NEAR(blend.summary(1).dimmed, 1 / 1.5, 0.01);
}

TEST(LightBlend, aPlaceTooDarkDoesNotDimEverything) {
  // The second one sees the floor as far as the horizon, and so does the first one.
  const calib::Lens lens = test::lens(640, 400, 520, 319.5, 199.5);
  LightBlend blend({{lens, 1000}, {lens, 1000}}, false);
  blend.update({kFloor}, {looking({0, 0, 1}, {0.1, 5, 1}), looking({0.3, 0, 1}, {0.3, 5, 1})});
  EXPECT_GE(blend.summary(0).dimmed, LightBlend::kLeastEvened - 1e-6);
}

TEST(LightBlend, blackIsRaisedWhereFewerLight) {
  const calib::Lens lens = test::lens(640, 400, 520, 319.5, 199.5);
  const Poses poses = {looking({-0.7, 0, 2}, {-0.7, 0, 0}), looking({0.7, 0, 2}, {0.7, 0, 0})};
  LightBlend blend({{lens, 0, 1, 0.002}, {lens, 0, 1, 0.003}}, true);
  blend.update({kFloor}, poses);
  for (double x = -1.8; x < 1.8; x += 0.05) {
    double black = 0;
    for (std::size_t i = 0; i < 2; ++i) {
      const Seen seen = seenAt(blend, i, lens, *poses[i], {x, 0, 0});
      if (seen.is_lit) black += (i == 0 ? 0.002 : 0.003) + seen.raise;
    }
    EXPECT_NEAR(black, 0.005, 0.0001) << x;
  }
  EXPECT_NEAR(blend.summary(0).raised, 0.003, 1e-4);
}

TEST(LightBlend, takesAPoseForEachOfAFewProjectors) {
  EXPECT_THROW(LightBlend(std::vector<BlendedProjector>(33, {kBent}), false), std::logic_error);
  LightBlend blend({{kBent}, {kBent}}, false);
  EXPECT_THROW(blend.update({kFloor}, {std::nullopt}), std::logic_error);
}

}  // namespace
}  // namespace afterglow::render::light_blend_test
