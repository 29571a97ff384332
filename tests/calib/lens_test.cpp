#include "calib/lens.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <opencv2/calib3d.hpp>
#include <random>

#include "tests/support/optics.hpp"

namespace afterglow::calib::lens_test {
namespace {

/// Lenses from mild to the worst there are, principal points also far outside of the image.
Lens randomLens(std::mt19937& random, bool rational) {
  const auto within = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const double f = within(700, 2000);
  Eigen::Matrix3d K;
  K << f, 0, within(-200, 1480), 0, f * within(0.98, 1.02), within(-300, 1100), 0, 0, 1;
  std::vector<double> D = {within(-0.35, 0.15), within(-0.1, 0.1), within(-0.003, 0.003),
                           within(-0.003, 0.003), within(-0.05, 0.05)};
  if (rational) {
    for (int i = 0; i < 3; ++i) D.push_back(within(0, 0.05));
  }
  return makeLens(1280, 800, K, D);
}

/// A point in front of the lens whose normalized radius is at most `radius`.
Eigen::Vector3d randomPoint(std::mt19937& random, double radius) {
  std::uniform_real_distribution<double> angle(0, 2 * M_PI), share(0, 1), depth(0.3, 4);
  const double a = angle(random), r = radius * std::sqrt(share(random)), z = depth(random);
  return {z * r * std::cos(a), z * r * std::sin(a), z};
}

TEST(Lens, projectsLikeOpenCv) {
  std::mt19937 random(1);
  for (int i = 0; i < 200; ++i) {
    const Lens lens = randomLens(random, i % 2 == 0);
    std::vector<Eigen::Vector3d> points;
    for (int j = 0; j < 50; ++j) {
      points.push_back(randomPoint(random, std::min(1.0, 0.999 * lens.fold_radius)));
    }
    const auto expected = test::projectWithOpenCv(lens, points);
    for (std::size_t j = 0; j < points.size(); ++j) {
      const auto pixel = project(lens, points[j]);
      ASSERT_TRUE(pixel);
      EXPECT_LT((*pixel - expected[j]).norm(), 1e-8);
    }
  }
}

TEST(Lens, unprojectInvertsProject) {
  std::mt19937 random(2);
  for (int i = 0; i < 200; ++i) {
    const Lens lens = randomLens(random, i % 2 == 0);
    for (int j = 0; j < 50; ++j) {
      // Tangential distortion moves the true fold by a few percent.
      const Eigen::Vector3d p = randomPoint(random, std::min(1.0, 0.9 * lens.fold_radius));
      const auto pixel = project(lens, p);
      ASSERT_TRUE(pixel);
      const auto ray = unproject(lens, *pixel);
      ASSERT_TRUE(ray) << "radius " << (p.head<2>() / p.z()).norm() << " of " << lens.fold_radius;
      EXPECT_LT((*ray - p / p.z()).norm(), 1e-8);
    }
  }
}

TEST(Lens, unprojectsLikeOpenCvWhereThatConverges) {
  std::mt19937 random(3);
  const cv::TermCriteria criteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 100, 1e-12);
  for (int i = 0; i < 50; ++i) {
    const Lens lens = randomLens(random, false);
    const Eigen::Vector2d pixel =
        *project(lens, randomPoint(random, std::min(0.4, 0.5 * lens.fold_radius)));
    std::vector<cv::Point2d> out;
    cv::undistortPoints(std::vector<cv::Point2d>{{pixel.x(), pixel.y()}}, out, test::cvK(lens),
                        std::vector<double>(lens.D.begin(), lens.D.end()), cv::noArray(),
                        cv::noArray(), criteria);
    const auto ray = unproject(lens, pixel);
    ASSERT_TRUE(ray);
    EXPECT_LT((ray->head<2>() - Eigen::Vector2d(out[0].x, out[0].y)).norm(), 1e-7);
  }
}

/// Fisheyes from bent little to far.
Lens randomFisheye(std::mt19937& random) {
  const auto within = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  Eigen::Matrix3d K;
  K << within(300, 900), within(0, 3), within(-200, 1480), 0, within(300, 900), within(-300, 1100),
      0, 0, 1;
  return makeLens(
      1280, 800, K,
      {within(-0.08, 0.08), within(-0.03, 0.03), within(-0.01, 0.01), within(-0.003, 0.003)},
      LensModel::Equidistant);
}

TEST(Lens, equidistantProjectsLikeOpenCvAndBack) {
  std::mt19937 random(4);
  for (int i = 0; i < 100; ++i) {
    const Lens lens = randomFisheye(random);
    std::vector<Eigen::Vector3d> points;
    for (int j = 0; j < 50; ++j) {
      points.push_back(randomPoint(random, std::min(20.0, 0.99 * lens.fold_radius)));
    }
    const auto expected = test::projectWithOpenCv(lens, points);
    for (std::size_t j = 0; j < points.size(); ++j) {
      const auto pixel = project(lens, points[j]);
      ASSERT_TRUE(pixel);
      EXPECT_LT((*pixel - expected[j]).norm(), 1e-8);
      const auto ray = unproject(lens, *pixel);
      ASSERT_TRUE(ray);
      EXPECT_LT((distort(lens, ray->head<2>()) - distort(lens, points[j].hnormalized())).norm(),
                2e-12);
    }
  }
}

/// Pixel of a ray through a lens whose parameter `i`, in PixelSlope's order, is larger by `step`.
Eigen::Vector2d pixelBeside(Lens lens, const Eigen::Vector2d& ray, int i, double step) {
  double* const focal[] = {&lens.K(0, 0), &lens.K(1, 1), &lens.K(0, 2), &lens.K(1, 2),
                           &lens.K(0, 1)};
  (i < 5 ? *focal[i] : lens.D[std::size_t(i) - 5]) += step;
  return *project(lens, ray.homogeneous());
}

void expectSlopesLikeDifferences(const Lens& lens, const Eigen::Vector2d& ray) {
  constexpr double kStep = 1e-5, kBound = 1e-5;  // px for each unit, of hundreds
  const PixelSlope slope = pixelSlope(lens, ray);
  EXPECT_LT((slope.pixel - *project(lens, ray.homogeneous())).norm(), 1e-9);
  for (int i = 0; i < 2; ++i) {
    const Eigen::Vector2d step = kStep * Eigen::Vector2d::Unit(i);
    const Eigen::Vector2d change =
        *project(lens, (ray + step).homogeneous()) - *project(lens, (ray - step).homogeneous());
    EXPECT_LT((slope.by_ray.col(i) - change / (2 * kStep)).norm(), kBound) << i;
  }
  for (int i = 0; i < 13; ++i) {
    const Eigen::Vector2d change =
        pixelBeside(lens, ray, i, kStep) - pixelBeside(lens, ray, i, -kStep);
    EXPECT_LT((slope.by_lens.col(i) - change / (2 * kStep)).norm(), kBound) << i;
  }
}

TEST(Lens, slopesAreThoseOfSmallSteps) {
  std::mt19937 random(6);
  for (int i = 0; i < 100; ++i) {
    Lens brown = randomLens(random, true),
         fisheye = test::fisheye(1280, 800, 400, 640, 400, {0.05, -0.02, 0.01, 0.004});
    brown.K(0, 1) = fisheye.K(0, 1) = 3;
    brown.fold_radius = std::numeric_limits<double>::infinity();
    const Eigen::Vector3d p = randomPoint(random, 0.6);
    expectSlopesLikeDifferences(brown, p.hnormalized());
    expectSlopesLikeDifferences(fisheye, p.hnormalized());
  }
  Lens fisheye = test::fisheye(1280, 800, 400, 640, 400, {0.05, -0.02, 0.01, 0.004});
  EXPECT_LT((pixelSlope(fisheye, {0, 0}).by_ray - 400 * Eigen::Matrix2d::Identity()).norm(), 1e-9);
}

TEST(Lens, equidistantEndsAtItsFoldOrBelowNinetyDegrees) {
  const Lens wide = test::fisheye(1280, 800, 400, 640, 400, {0, 0, 0, 0});
  EXPECT_EQ(wide.fold_radius, 100);
  EXPECT_TRUE(project(wide, {99, 0, 1}));
  EXPECT_FALSE(project(wide, {101, 0, 1}));
  EXPECT_FALSE(project(wide, {1, 0, 0}));
  EXPECT_FALSE(unproject(wide, {640 + 630, 400})) << "400 pi / 2 = 628 px are 90 degrees";
  EXPECT_EQ(*unproject(wide, {640, 400}), Eigen::Vector3d(0, 0, 1));
  // 1 - 3 k1 t^2 ends at t = 1.
  const Lens folded = test::fisheye(1280, 800, 400, 640, 400, {-1.0 / 3, 0, 0, 0});
  EXPECT_NEAR(std::atan(folded.fold_radius), 1, 1e-9);
  EXPECT_FALSE(project(folded, {std::tan(1.01), 0, 1}));
  EXPECT_FALSE(unproject(folded, {640 + 400 * 0.67, 400}));
}

TEST(Lens, equidistantHasFourNumbersAndItsNames) {
  EXPECT_THROW(test::fisheye(1280, 800, 400, 640, 400, {0, 0, 0, 0, 0}), std::invalid_argument);
  EXPECT_THROW(test::fisheye(1280, 800, 400, 640, 400, {}), std::invalid_argument);
  const Lens lens = test::fisheye(1280, 800, 400, 640, 400, {0.1, 0, 0, 0});
  EXPECT_EQ(distortionModel(lens), "equidistant");
  EXPECT_EQ(distortionCoefficients(lens), (std::vector<double>{0.1, 0, 0, 0}));
  EXPECT_EQ(lensModelNamed("equidistant"), LensModel::Equidistant);
  EXPECT_EQ(lensModelNamed("fisheye"), LensModel::Equidistant);
  EXPECT_EQ(lensModelNamed("plumb_bob"), LensModel::BrownConrady);
  EXPECT_FALSE(lensModelNamed("fov"));
}

TEST(Lens, minusThirdOfK1FoldsAtItsRadius) {
  // d(r + k1 r^3)/dr = 0 at r = (-1 / (3 k1))^(1/2).
  const Lens lens = test::lens(1280, 800, 700, 640, 400, {-0.35, 0, 0, 0, 0});
  EXPECT_NEAR(lens.fold_radius, std::sqrt(1 / (3 * 0.35)), 1e-9);
  EXPECT_EQ(foldRadius(lens), lens.fold_radius);
  EXPECT_TRUE(project(lens, {0.97, 0, 1}));
  EXPECT_FALSE(project(lens, {0.98, 0, 1}));
  EXPECT_FALSE(project(lens, {1.69, 0, 1})) << "lands on the image's center again";
}

TEST(Lens, staysFoldedWhereTheModelGrowsAgain) {
  // 1 - 1.5 s + 0.5 s^2 in s = r^2 is negative between 1 and 2 only.
  const Lens lens = test::lens(1280, 800, 700, 640, 400, {-0.5, 0.1, 0, 0, 0});
  EXPECT_NEAR(lens.fold_radius, 1, 1e-9);
  EXPECT_FALSE(project(lens, {3, 0, 1}));
}

TEST(Lens, pixelsBeyondTheFoldHaveNoRay) {
  const Lens lens = test::lens(1280, 800, 700, 640, 400, {-0.35, 0, 0, 0, 0});
  EXPECT_TRUE(unproject(lens, {640 + 450, 400}));
  EXPECT_FALSE(unproject(lens, {640 + 460, 400})) << "700 * 0.976 * 2/3 = 455.5 is the farthest";
}

TEST(Lens, undistortedHasNoFold) {
  EXPECT_TRUE(std::isinf(test::viewsonic().fold_radius));
  EXPECT_TRUE(std::isinf(test::viewsonic({0.1, 0, 0, 0, 0}).fold_radius));
}

TEST(Lens, behindAndInTheLensThereIsNoPixel) {
  const Lens lens = test::viewsonic();
  EXPECT_FALSE(project(lens, {0, 0, -1}));
  EXPECT_FALSE(project(lens, {0, 0, 0}));
  EXPECT_FALSE(project(lens, {0, 0, std::nan("")}));
}

TEST(Lens, keepsPrincipalPointOutsideImage) {
  const auto pixel = project(test::viewsonic(), {0, 0, 2});
  ASSERT_TRUE(pixel);
  EXPECT_EQ(*pixel, Eigen::Vector2d(640, 817));
}

TEST(Lens, skewsX) {
  Eigen::Matrix3d K;
  K << 1000, 5, 640, 0, 1100, 400, 0, 0, 1;
  const Lens lens = makeLens(1280, 800, K, {});
  const auto pixel = project(lens, {0.1, 0.2, 1});
  EXPECT_LT((*pixel - Eigen::Vector2d(741, 620)).norm(), 1e-9);
  EXPECT_LT((*unproject(lens, *pixel) - Eigen::Vector3d(0.1, 0.2, 1)).norm(), 1e-12);
}

TEST(Lens, namesAllThatIsWrongAtOnce) {
  Eigen::Matrix3d K = Eigen::Matrix3d::Zero();
  K(2, 2) = 1;
  try {
    makeLens(0, 800, K, {1, 2, std::nan("")});
    FAIL() << "accepted";
  } catch (const std::invalid_argument& error) {
    const std::string text = error.what();
    for (const char* part : {"0 x 800", "fx", "fy", "D has 3 numbers", "D holds"}) {
      EXPECT_NE(text.find(part), std::string::npos) << part << " in: " << text;
    }
  }
}

}  // namespace
}  // namespace afterglow::calib::lens_test
