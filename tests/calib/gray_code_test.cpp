// Photographs of Gray codes on a chessboard, rendered here by optics of their own: found, decoded,
// and solved to the projector that made them.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>

#include "calib/gray_code/gray_code_views.hpp"
#include "calib/gray_code/set.hpp"
#include "calib/solver/solve.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::calib::gray_code_test {
namespace {

using test::TempFolder;

const Chessboard kChessboard{7, 5, 0.05};
constexpr int kCameraWidth = 640, kCameraHeight = 480, kWidth = 256, kHeight = 192, kBits = 8;
constexpr double kCameraFocal = 700, kFocal = 300;

struct Optics {
  Eigen::Isometry3d T_projector_camera = Eigen::Isometry3d::Identity();

  Optics() {
    T_projector_camera.linear() =
        Eigen::AngleAxisd(0.12, Eigen::Vector3d::UnitY()).toRotationMatrix();
    T_projector_camera.translation() << -0.15, 0.04, 0.02;
  }
  /// K: pinholes in the middle of the camera's picture, and low in the projector's.
  static Eigen::Vector3d cameraRay(double x, double y) {
    return {(x - 319.5) / kCameraFocal, (y - 239.5) / kCameraFocal, 1};
  }
  Eigen::Vector2d projectorPixel(const Eigen::Vector3d& p_camera) const {
    const Eigen::Vector3d p = T_projector_camera * p_camera;
    return {kFocal * p.x() / p.z() + 127.5, kFocal * p.y() / p.z() + 110};
  }
};

/// A pose of the board; its frame as of calib/frames.hpp: x right, y up, z to the viewer.
Eigen::Isometry3d boardPose(int pose) {
  constexpr double kTurns[6][2] = {{0, 0},     {0.5, 0},  {-0.5, 0.1},
                                   {0.1, 0.5}, {0, -0.5}, {0.4, 0.3}};
  constexpr double kPlaces[6][2] = {{0, 0},       {-.06, .03},  {.07, .02},
                                    {.05, -.05}, {-.05, -.04}, {0, .05}};
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = (Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()) *
                Eigen::AngleAxisd(kTurns[pose][0], Eigen::Vector3d::UnitY()) *
                Eigen::AngleAxisd(kTurns[pose][1], Eigen::Vector3d::UnitX()))
                   .toRotationMatrix();
  T.translation() << kPlaces[pose][0], kPlaces[pose][1], 0.75 + 0.03 * pose;
  return T;
}

bool bitOf(int value, int bit) { return (((value >> 1) ^ value) >> bit & 1) != 0; }

/// What a camera pixel sees: how bright its paper is, and what lights it.
struct Seen {
  double paper = 0;
  int column = 0, row = 0;  ///< of the projector
  bool is_lit = false;
};

Seen seenAt(const Optics& optics, const Eigen::Isometry3d& T_camera_board, double x, double y) {
  const Eigen::Vector3d ray = Optics::cameraRay(x, y);
  const Eigen::Vector3d normal = T_camera_board.linear().col(2);
  const Eigen::Vector3d p = ray * (normal.dot(T_camera_board.translation()) / normal.dot(ray));
  const Eigen::Vector3d p_board = T_camera_board.inverse() * p;
  const Eigen::Vector2d square(p_board.x() / 0.05 + 4, p_board.y() / 0.05 + 3);  // of 8 x 6
  Seen seen;
  const bool is_square = square.minCoeff() >= 0 && square.x() < 8 && square.y() < 6;
  const bool is_black =
      is_square && (int(std::floor(square.x())) + int(std::floor(square.y()))) % 2 == 0;
  seen.paper = is_black ? 0.06 : 0.8;
  const Eigen::Vector2d pixel = optics.projectorPixel(p);
  seen.column = static_cast<int>(std::lround(pixel.x()));
  seen.row = static_cast<int>(std::lround(pixel.y()));
  seen.is_lit =
      seen.column >= 0 && seen.row >= 0 && seen.column < kWidth && seen.row < kHeight;
  return seen;
}

/// All pictures of a pose in kamino410's order; 2 x 2 samples a pixel. `first_row`: its code.
std::vector<Picture> render(const Optics& optics, const Eigen::Isometry3d& T_camera_board,
                            int first_row = 0) {
  const std::size_t pictures = 4 * kBits + 2;
  const Picture empty{kCameraWidth, kCameraHeight,
                      std::vector<std::uint8_t>(std::size_t(kCameraWidth * kCameraHeight))};
  std::vector<Picture> shown(pictures, empty);
  for (int y = 0; y < kCameraHeight; ++y) {
    for (int x = 0; x < kCameraWidth; ++x) {
      std::vector<double> light(pictures, 0);
      for (int sample = 0; sample < 4; ++sample) {
        const Seen seen = seenAt(optics, T_camera_board, x - 0.25 + 0.5 * (sample % 2),
                                 y - 0.25 + 0.5 * (sample / 2));
        for (std::size_t i = 0; i < pictures; ++i) {
          const int bit = kBits - 1 - static_cast<int>(i / 2) % kBits;
          const bool is_white = i == pictures - 2, is_black = i == pictures - 1;
          const bool code = bitOf(i < 2 * kBits ? seen.column : first_row + seen.row, bit);
          const bool is_on = is_white || (!is_black && code == (i % 2 == 0));
          light[i] += seen.paper * (8 + (seen.is_lit && is_on ? 180 : 0)) / 4;
        }
      }
      for (std::size_t i = 0; i < pictures; ++i) {
        shown[i].pixels[std::size_t(y * kCameraWidth + x)] =
            static_cast<std::uint8_t>(std::lround(light[i]));
      }
    }
  }
  return shown;
}

/// Folders as of kamino410, or of Brown University: other names, and white and black first.
void save(const std::string& folder, int pose, std::vector<Picture> pictures, bool is_kamino) {
  if (!is_kamino) std::rotate(pictures.begin(), pictures.end() - 2, pictures.end());
  const std::string to = folder + (is_kamino ? "/capture_" : "/pose_") + std::to_string(pose);
  std::filesystem::create_directories(to);
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const std::string number = (i < 10 ? "0" : "") + std::to_string(is_kamino ? i : i + 1);
    savePicture(to + (is_kamino ? "/graycode_" : "/cam_") + number + ".png", pictures[i]);
  }
}

GrayCodeOptions optionsFor(const std::string& folder) {
  GrayCodeOptions options;
  options.folder = folder;
  options.chessboard = kChessboard;
  options.width = kWidth;
  options.height = kHeight;
  return options;
}

Eigen::Matrix3d cameraK() {
  Eigen::Matrix3d K = Eigen::Matrix3d::Identity();
  K(0, 0) = K(1, 1) = kCameraFocal;
  return K;
}

std::string complaint(const GrayCodeOptions& options) {
  try {
    readGrayCode(options);
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

TEST(GrayCode, decodesEachPixelToTheOneThatLightsIt) {
  const Optics optics;
  const Eigen::Isometry3d pose = boardPose(1);
  const GrayCode code = grayCodeOf(GrayCodeLayout::Kamino, 34, kWidth, kHeight);
  const DecodedLight light = decode(render(optics, pose), code);
  const Eigen::Vector3d normal = pose.linear().col(2);
  std::size_t decoded = 0;
  for (int y = 0; y < kCameraHeight; ++y) {
    for (int x = 0; x < kCameraWidth; ++x) {
      if (std::isnan(light.at(x, y).x())) continue;
      ++decoded;
      const Eigen::Vector3d ray = Optics::cameraRay(x, y);
      const Eigen::Vector2d truth =
          optics.projectorPixel(ray * (normal.dot(pose.translation()) / normal.dot(ray)));
      const Eigen::Vector2d off = light.at(x, y).cast<double>() - truth;
      ASSERT_LT(off.cwiseAbs().maxCoeff(), 0.8) << x << " " << y;
    }
  }
  EXPECT_GT(decoded, std::size_t(kCameraWidth * kCameraHeight / 3));
}

TEST(GrayCode, solvesTheProjectorOfEitherLayout) {
  const Optics optics;
  const TempFolder kamino, brown;
  for (int pose = 0; pose < 6; ++pose) {
    save(kamino.path("set"), pose, render(optics, boardPose(pose)), true);
  }
  const GrayCodeViews set = readGrayCode(optionsFor(kamino.path("set")));
  EXPECT_NEAR(set.camera.K(0, 0), kCameraFocal, 0.01 * kCameraFocal);
  SolveOptions options;
  options.camera_use = CameraUse::Refine;
  const Calibration result = solveViews(set.views, set.board, set.pattern, set.camera, options);
  EXPECT_LT(result.held_out_rms_px, 0.1);
  EXPECT_NEAR(result.estimate.projector.K(0, 0), kFocal, 0.01 * kFocal);
  const Eigen::Vector3d place = result.estimate.T_camera_projector.matrix().translation();
  EXPECT_LT((place - optics.T_projector_camera.inverse().translation()).norm(), 0.01);

  // Its rows' codes lie in the middle of the 256 that eight bits can write.
  save(brown.path("set"), 0, render(optics, boardPose(0), (256 - kHeight) / 2), false);
  GrayCodeOptions of_brown = optionsFor(brown.path("set"));
  of_brown.camera = set.camera;
  const GrayCodeViews same = readGrayCode(of_brown);
  ASSERT_EQ(same.views.size(), 1U);
  const std::vector<SeenTag>& lit = same.views[0].projected;
  ASSERT_EQ(lit.size(), set.views[0].projected.size());
  ASSERT_GT(lit.size(), 20U);
  for (std::size_t i = 0; i < lit.size(); ++i) {
    EXPECT_EQ(lit[i].id, set.views[0].projected[i].id);
    EXPECT_LT((lit[i].corners[0] - set.views[0].projected[i].corners[0]).norm(), 1e-6);
  }
}

TEST(GrayCode, knowsTheCodeByTheNumberOfItsPictures) {
  EXPECT_EQ(grayCodeOf(GrayCodeLayout::Kamino, 42, 1024, 768).across.step, 1);
  EXPECT_EQ(grayCodeOf(GrayCodeLayout::Kamino, 38, 1024, 768, 2).down.step, 2);
  const GrayCode brown = grayCodeOf(GrayCodeLayout::Brown, 42, 1280, 800);
  EXPECT_EQ(brown.across.step, 2) << "ten of the columns' eleven bits are shown";
  EXPECT_EQ(brown.down.step, 1);
  EXPECT_EQ(brown.down.offset, 112);
  EXPECT_THROW(grayCodeOf(GrayCodeLayout::Kamino, 41, 1024, 768), std::invalid_argument);
  // A wrong resolution must not pass as a coarser code.
  EXPECT_THROW(grayCodeOf(GrayCodeLayout::Kamino, 42, 1920, 1080), std::invalid_argument);
}

TEST(GrayCode, namesWhatIsWrongWithASet) {
  const Optics optics;
  const TempFolder folder;
  std::filesystem::create_directories(folder.path("set"));
  EXPECT_NE(complaint(optionsFor(folder.path("set"))).find("holds no capture_"), std::string::npos);
  std::vector<Picture> pictures = render(optics, boardPose(0));
  save(folder.path("set"), 0, pictures, true);
  GrayCodeOptions options = optionsFor(folder.path("set"));
  EXPECT_NE(complaint(options).find("give it with --camera"), std::string::npos);
  options.width = 100;
  EXPECT_NE(complaint(options).find("capture_0: 34 pictures are no Gray code"), std::string::npos);
  options.width = 160;
  EXPECT_NE(complaint(options).find("shows codes beyond 160 x 192 px"), std::string::npos);
  options.width = kWidth;
  options.camera = makeLens(800, 600, cameraK(), {});
  EXPECT_NE(complaint(options).find("the camera_info says 800 x 600"), std::string::npos);
  std::filesystem::remove(folder.path("set") + "/capture_0/graycode_07.png");
  EXPECT_NE(complaint(options).find("picture number 7 is missing"), std::string::npos);
}

TEST(GrayCode, leavesOutAViewWithoutTheChessboard) {
  const TempFolder folder;
  std::vector<Picture> pictures = render(Optics(), boardPose(0));
  save(folder.path("set"), 0, pictures, true);
  GrayCodeOptions options = optionsFor(folder.path("set"));
  options.chessboard = {9, 6, 0.05};
  options.camera = makeLens(kCameraWidth, kCameraHeight, cameraK(), {});
  const GrayCodeViews set = readGrayCode(options);
  ASSERT_EQ(set.views.at(0).faults.size(), 1U);
  EXPECT_NE(set.views[0].faults[0].find("no chessboard of 9 x 6 inner corners was found in"),
            std::string::npos);
}

}  // namespace
}  // namespace afterglow::calib::gray_code_test
