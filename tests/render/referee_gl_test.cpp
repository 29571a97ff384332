// The independent referee: a marker on the floor, rendered for a rig that it made up and thrown
// back on the floor by it, lies where it should.
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "render/image_file.hpp"
#include "tests/support/gl_context.hpp"
#include "tests/support/optics.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::render {
namespace {

const std::string kReferee = "../shared/tools/procam_sim.py";
constexpr double kPatch = 0.4;        // m, side of the piece of floor that is looked at
constexpr double kStep = 0.0005;      // m, a pixel of its picture
constexpr double kTolerance = 0.001;  // m: what is asked for

int run(const std::string& command, const std::string& log) {
  return std::system((command + " 2>> " + log).c_str());
}

struct Rig {
  calib::Lens lens;
  Rigid<World, Projector> T_world_projector;
};

Rig readRig(const YAML::Node& rig) {
  const auto K = rig["projector"]["K"].as<std::vector<double>>();
  Rig result;
  result.lens =
      calib::makeLens(rig["projector"]["width"].as<int>(), rig["projector"]["height"].as<int>(),
                      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(K.data()),
                      rig["projector"]["D"].as<std::vector<double>>());
  Eigen::Isometry3d T;
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) {
      T.matrix()(row, column) = rig["T_world_projector"][row][column].as<double>();
    }
  }
  result.T_world_projector = Rigid<World, Projector>(T);
  return result;
}

/// Where the ray of a pixel meets the floor.
Eigen::Vector2d onFloor(const Rig& rig, const Eigen::Vector2d& pixel) {
  const Eigen::Vector3d eye = rig.T_world_projector * Eigen::Vector3d::Zero();
  const Eigen::Vector3d ray = rig.T_world_projector * *calib::unproject(rig.lens, pixel) - eye;
  return (eye - ray * eye.z() / ray.z()).head<2>();
}

class Referee : public test::GlTest {
 protected:
  void SetUp() override {
    GlTest::SetUp();
    if (IsSkipped() || HasFatalFailure()) return;
    if (!std::filesystem::exists(kReferee)) GTEST_SKIP() << kReferee << " is not here";
    if (run(kReferee + " --help > " + folder_.path("help"), folder_.path("log")) != 0) {
      GTEST_SKIP() << kReferee << " does not run: python3-numpy, -opencv or -yaml is missing";
    }
  }

  /// What lands on the floor around `center`, 0 to 1, row by row from y's greatest.
  cv::Mat throwBack(YAML::Node rig, const Eigen::Vector2d& center, const Image& frame) {
    YAML::Node T(YAML::NodeType::Sequence);
    const Eigen::Matrix4d M =
        (Eigen::Translation3d(center.x(), center.y(), 0) * Eigen::Isometry3d::Identity()).matrix();
    for (int row = 0; row < 4; ++row) {
      for (int column = 0; column < 4; ++column) T[row][column] = M(row, column);
    }
    rig["surfaces"][0]["T_world_surface"] = T;
    rig["surfaces"][0]["size"] = std::vector<double>{kPatch, kPatch};
    std::ofstream(folder_.path("patch.yaml")) << rig;
    writePng(folder_.path("frame.png"), frame);
    const int status = run(kReferee + " topview --surface floor --mm-per-px 0.5 --frame " +
                               folder_.path("frame.png") + " --truth " +
                               folder_.path("patch.yaml") + " --out " + folder_.path("top.png"),
                           folder_.path("log"));
    EXPECT_EQ(status, 0);
    cv::Mat top;
    cv::imread(folder_.path("top.png"), cv::IMREAD_GRAYSCALE).convertTo(top, CV_64F, 1 / 255.0);
    return top;
  }

  static double light(const cv::Mat& top, const Eigen::Vector2d& p) {
    const double x = (p.x() + kPatch / 2) / kStep - 0.5, y = (kPatch / 2 - p.y()) / kStep - 0.5;
    const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
    const double a = x - x0, b = y - y0;
    const auto at = [&](int row, int column) { return top.at<double>(row, column); };
    return (at(y0, x0) * (1 - a) + at(y0, x0 + 1) * a) * (1 - b) +
           (at(y0 + 1, x0) * (1 - a) + at(y0 + 1, x0 + 1) * a) * b;
  }

  static Eigen::Vector2d centroid(const cv::Mat& top) {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    double weight = 0;
    for (int row = 0; row < top.rows; ++row) {
      for (int column = 0; column < top.cols; ++column) {
        const double w = top.at<double>(row, column);
        sum += w * Eigen::Vector2d((column + 0.5) * kStep - kPatch / 2,
                                   kPatch / 2 - (row + 0.5) * kStep);
        weight += w;
      }
    }
    return sum / weight;
  }

  /// How far outwards from a point on an outline light falls to one half.
  static double edgeOffset(const cv::Mat& top, const Eigen::Vector2d& p, const Eigen::Vector2d& n) {
    constexpr double kReach = 0.012, kTick = 0.0001;
    double offset = -kReach;
    while (offset < kReach && light(top, p + n * offset) > 0.5) offset += kTick;
    return offset;
  }

  void expectLands(const std::string& kind, int seed, const Eigen::Vector2d& share) {
    SCOPED_TRACE(kind + " " + std::to_string(seed));
    ASSERT_EQ(run(kReferee + " rig --kind " + kind + " --seed " + std::to_string(seed) + " > " +
                      folder_.path("rig.yaml"),
                  folder_.path("log")),
              0);
    const YAML::Node yaml = YAML::LoadFile(folder_.path("rig.yaml"));
    const Rig rig = readRig(yaml);
    const Eigen::Vector2d at = share.cwiseProduct(Eigen::Vector2d(rig.lens.width, rig.lens.height));
    const Eigen::Vector2d center = onFloor(rig, at);

    const Eigen::Vector2d size(0.16, 0.1);
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translation() << center.x(), center.y(), 0.05;
    const Eigen::Matrix2d R = Eigen::Rotation2Dd(0.5).toRotationMatrix();
    T.linear().topLeftCorner<2, 2>() = R;
    Layer layer;
    layer.name = "/marker";
    layer.placement = Placement::Drape;
    layer.surface = SurfacePatch{"floor", {}, {}};
    layer.drawables = {{Rigid<World, World>(T),
                        Cube{Eigen::Vector3d(size.x(), size.y(), 0.03).cast<float>()},
                        {}}};
    const Image frame =
        ProjectorRenderer(context(), rig.lens).render({{layer}}, rig.T_world_projector.inverse());
    const cv::Mat top = throwBack(yaml, center, frame);
    ASSERT_FALSE(top.empty());

    const Eigen::Vector2d found = centroid(top);
    double worst = 0, sum = 0;
    int count = 0;
    for (const Eigen::Vector2d& n : {Eigen::Vector2d(1, 0), Eigen::Vector2d(-1, 0),
                                     Eigen::Vector2d(0, 1), Eigen::Vector2d(0, -1)}) {
      const Eigen::Vector2d along(n.y(), n.x());
      for (int i = -8; i <= 8; ++i) {
        const Eigen::Vector2d p = (n + along * (i / 10.0)).cwiseProduct(size) / 2;
        const double offset = edgeOffset(top, R * p, R * n);
        worst = std::max(worst, std::abs(offset));
        sum += std::abs(offset);
        ++count;
      }
    }
    std::printf("%-11s seed %d: centroid %.2f mm off, edges %.2f mm on average, %.2f mm at most\n",
                kind.c_str(), seed, 1e3 * found.norm(), 1e3 * sum / count, 1e3 * worst);
    EXPECT_LT(found.norm(), kTolerance);
    // An edge is drawn to a quarter of a pixel, which is all that a coarse pixel can show.
    const double pixel = std::max((onFloor(rig, at + Eigen::Vector2d(1, 0)) - center).norm(),
                                  (onFloor(rig, at + Eigen::Vector2d(0, 1)) - center).norm());
    EXPECT_LT(worst, std::max(kTolerance, 0.3 * pixel)) << "a pixel is " << pixel << " m";
    EXPECT_LT(sum / count, kTolerance);
  }

  test::TempFolder folder_;
};

TEST_F(Referee, markerLandsWithinAMillimetreOnAllKindsOfRigs) {
  expectLands("standard", 1, {0.5, 0.5});
  expectLands("standard", 2, {0.8, 0.8});
  expectLands("lens_shift", 3, {0.5, 0.6});
  expectLands("lens_shift", 4, {0.15, 0.85});
  expectLands("wide", 5, {0.5, 0.55});
  expectLands("wide", 6, {0.15, 0.85});
  expectLands("short_throw", 7, {0.8, 0.9});
}

}  // namespace
}  // namespace afterglow::render
