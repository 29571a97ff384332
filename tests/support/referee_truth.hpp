/// \file
/// What the referee's programs (tests/referee) write of the truth: lenses and poses, as its YAML
/// has them.
#pragma once

#include <yaml-cpp/yaml.h>

#include <Eigen/Geometry>
#include <vector>

#include "calib/lens.hpp"

namespace afterglow::test {

inline calib::Lens readTrueLens(const YAML::Node& yaml) {
  const auto K = yaml["K"].as<std::vector<double>>();
  return calib::makeLens(yaml["width"].as<int>(), yaml["height"].as<int>(),
                         Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(K.data()),
                         yaml["D"].as<std::vector<double>>());
}

inline Eigen::Isometry3d readTruePose(const YAML::Node& yaml) {
  Eigen::Isometry3d T;
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column)
      T.matrix()(row, column) = yaml[row][column].as<double>();
  }
  return T;
}

}  // namespace afterglow::test
