/// \file
/// A projector and a room that the referee judges.
#pragma once

#include <yaml-cpp/yaml.h>

#include <Eigen/Geometry>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "calib/frames.hpp"
#include "calib/lens.hpp"
#include "render/image_file.hpp"
#include "tests/support/referee_program.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::test {

/// A rectangle around its frame's origin.
struct RefereeSurface {
  std::string name;
  Eigen::Isometry3d T_world_surface = Eigen::Isometry3d::Identity();
  double width = 1, height = 1;
};

/// A projector that the referee made up, and a room for it.
class Referee {
 public:
  static constexpr double kStep = 0.0005;  // m, a pixel of its pictures

  Referee(const std::string& kind, int seed) {
    run("rig --kind " + kind + " --seed " + std::to_string(seed) + " > " +
        folder_.path("rig.yaml"));
    rig_ = YAML::LoadFile(folder_.path("rig.yaml"));
    const YAML::Node projector = rig_["projector"];
    const auto K = projector["K"].as<std::vector<double>>();
    lens = calib::makeLens(projector["width"].as<int>(), projector["height"].as<int>(),
                           Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(K.data()),
                           projector["D"].as<std::vector<double>>());
    Eigen::Isometry3d T;
    for (int row = 0; row < 4; ++row) {
      for (int column = 0; column < 4; ++column) {
        T.matrix()(row, column) = rig_["T_world_projector"][row][column].as<double>();
      }
    }
    T_world_projector = Rigid<World, Projector>(T);
  }

  /// What of the frame lands on the named surface, 0 to 1, row by row from y's greatest; the others
  /// throw their shadows on it.
  cv::Mat topView(const render::Image& frame, const std::vector<RefereeSurface>& surfaces,
                  const std::string& name) {
    rig_["surfaces"] = YAML::Node(YAML::NodeType::Sequence);
    for (const RefereeSurface& surface : surfaces) rig_["surfaces"].push_back(asYaml(surface));
    std::ofstream(folder_.path("room.yaml")) << rig_;
    render::writePng(folder_.path("frame.png"), frame);
    run("topview --surface " + name + " --mm-per-px 0.5 --frame " + folder_.path("frame.png") +
        " --truth " + folder_.path("room.yaml") + " --out " + folder_.path("top.png"));
    cv::Mat top;
    cv::imread(folder_.path("top.png"), cv::IMREAD_GRAYSCALE).convertTo(top, CV_64F, 1 / 255.0);
    return top;
  }

  calib::Lens lens;
  Rigid<World, Projector> T_world_projector;

 private:
  void run(const std::string& arguments) const {
    if (runReferee(arguments, folder_.path("log")) == 0) return;
    std::ifstream log(folder_.path("log"));
    throw std::runtime_error(std::string(std::istreambuf_iterator<char>(log), {}));
  }

  static YAML::Node asYaml(const RefereeSurface& surface) {
    YAML::Node node;
    node["name"] = surface.name;
    node["size"] = std::vector<double>{surface.width, surface.height};
    for (int row = 0; row < 4; ++row) {
      for (int column = 0; column < 4; ++column) {
        node["T_world_surface"][row][column] = surface.T_world_surface.matrix()(row, column);
      }
    }
    return node;
  }

  TempFolder folder_;
  YAML::Node rig_;
};

}  // namespace afterglow::test
