// The independent referee photographs the planned tags of light on its floor: with the true
// calibration they lie where they should, with another the error is what that other means.
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <fstream>

#include "calib/targets/tag.hpp"
#include "calib/verify/throw_picture.hpp"
#include "tests/support/referee_program.hpp"
#include "tests/support/referee_truth.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::calib::verify_referee_test {
namespace {

constexpr double kSide = 1.0;  ///< m, of the printed mat on the floor
constexpr int kMatPixels = 2000;

/// Four printed tags in the corners of the mat, three thrown between them.
TagLayout matLayout() {
  TagLayout layout;
  layout.tags = {squareTag(0, {-0.38, 0.38}, 0.16, 0), squareTag(1, {0.38, 0.38}, 0.16, 0),
                 squareTag(2, {0.38, -0.38}, 0.16, 0), squareTag(3, {-0.38, -0.38}, 0.16, 0)};
  layout.targets = {squareTag(100, {0, 0}, 0.16, 0.2), squareTag(101, {-0.2, 0.1}, 0.12, 0),
                    squareTag(102, {0.15, 0.2}, 0.14, -0.7)};
  return layout;
}

Picture matPicture(const TagLayout& layout) {
  Picture mat{kMatPixels, kMatPixels, std::vector<std::uint8_t>(kMatPixels * kMatPixels, 255)};
  for (const Tag& tag : layout.tags) {
    const TagCells cells = tagCells(layout.family, tag.id);
    const double cell = (tag.corners[1] - tag.corners[0]).norm() / kTagCells;
    for (int y = 0; y < kMatPixels; ++y) {
      for (int x = 0; x < kMatPixels; ++x) {
        const double column =
            ((x + 0.5) / kMatPixels * kSide - kSide / 2 - tag.corners[0].x()) / cell;
        const double row = (tag.corners[0].y() - kSide / 2 + (y + 0.5) / kMatPixels * kSide) / cell;
        const bool is_tag = column >= 0 && row >= 0 && column < kTagCells && row < kTagCells;
        if (is_tag && cells[std::size_t(row)][std::size_t(column)]) {
          mat.pixels[std::size_t(y * kMatPixels + x)] = 0;
        }
      }
    }
  }
  return mat;
}

class VerifyReferee : public testing::Test {
 protected:
  void SetUp() override {
    const std::string absence = test::refereeAbsence();
    if (!absence.empty()) GTEST_SKIP() << absence;
    ASSERT_EQ(run("rig --kind standard --seed 3 > " + path("rig.yaml")), 0);
    rig_ = YAML::LoadFile(path("rig.yaml"));
    camera_ = test::readTrueLens(rig_["camera"]);
    projector_ = test::readTrueLens(rig_["projector"]);
    T_camera_projector_ =
        test::readTruePose(rig_["T_world_camera"]).inverse() *
        test::readTruePose(rig_["T_world_projector"]);
    savePicture(path("mat.png"), matPicture(layout_));
    YAML::Node surface = rig_["surfaces"][0];
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translation() = Eigen::Vector3d(0.02, 1.35, 0);
    for (int row = 0; row < 4; ++row) {
      for (int column = 0; column < 4; ++column) {
        surface["T_world_surface"][row][column] = T.matrix()(row, column);
      }
    }
    surface["size"] = std::vector<double>{kSide, kSide};
    surface["picture"] = "mat.png";
  }

  std::string path(const std::string& name) const { return folder_.path(name); }
  int run(const std::string& arguments) const {
    return test::runReferee(arguments, path("log"));
  }

  /// What the camera sees while the projector shows a picture.
  Picture shoot(const Picture& shown, int seed) {
    savePicture(path("shown.png"), shown);
    YAML::Node scene = YAML::Clone(rig_);
    scene["image"] = "shown.png";
    scene["seed"] = seed;
    std::ofstream(path("scene.yaml")) << scene;
    EXPECT_EQ(run("shoot --scene " + path("scene.yaml") + " --out " + path("photograph.png")), 0);
    return loadPicture(path("photograph.png"));
  }

  test::TempFolder folder_;
  YAML::Node rig_;
  TagLayout layout_ = matLayout();
  Lens camera_, projector_;
  Eigen::Isometry3d T_camera_projector_;
};

TEST_F(VerifyReferee, agreesOnWhereTheLightLies) {
  const Picture gray{projector_.width, projector_.height,
                     std::vector<std::uint8_t>(
                         std::size_t(projector_.width) * std::size_t(projector_.height), 160)};
  const Picture plain = shoot(gray, 1);
  const SurfacePose surface = locateSurface(plain, layout_, camera_);
  EXPECT_EQ(surface.tags.size(), 4u);
  EXPECT_LT(surface.rms_px, 0.1);
  const Rigid<Projector, Surface> T_projector_floor =
      Rigid<Camera, Projector>(T_camera_projector_).inverse() * surface.T_camera_surface;

  const ThrowCheck good = checkThrow(shoot(drawThrow(layout_, projector_, T_projector_floor), 2),
                                     plain, layout_, camera_);
  Lens shifted = projector_;
  shifted.K(0, 2) += 2;
  const ThrowCheck bad =
      checkThrow(shoot(drawThrow(layout_, shifted, T_projector_floor), 3), plain, layout_, camera_);
  ASSERT_EQ(good.targets.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    const Eigen::Vector2d place = middleOf(layout_.targets[i]);
    const auto meant =
        project(projector_, T_projector_floor * Eigen::Vector3d(place.x(), place.y(), 0));
    const Eigen::Vector2d two_px_mm =
        1000 * (*landing(projector_, *meant + Eigen::Vector2d(2, 0), T_projector_floor) - place);
    ASSERT_TRUE(good.targets[i].is_seen && bad.targets[i].is_seen) << i;
    std::printf("target %d: true calibration %.2f mm off, 2 px shifted %.2f mm, that is %.2f mm\n",
                good.targets[i].id, good.targets[i].offset_mm.norm(),
                bad.targets[i].offset_mm.norm(), two_px_mm.norm());
    EXPECT_LT(good.targets[i].offset_mm.norm(), 0.5);
    EXPECT_LT((bad.targets[i].offset_mm - two_px_mm).norm(), 0.5);
  }
  EXPECT_LT(summarize(good.errors()).p95_mm, 0.5);
  EXPECT_GT(summarize(bad.errors()).median_mm, 1.5);
}

}  // namespace
}  // namespace afterglow::calib::verify_referee_test
