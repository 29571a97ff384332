/// \file
/// The points that a robot's perception takes for objects on a table, in the robot's frame.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <fstream>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/real_data.hpp"

namespace afterglow::test {

/// x y z of each line after DATA; empty if the file cannot be read.
inline std::vector<Eigen::Vector3f> readPcd(const std::string& path) {
  std::ifstream file(path);
  std::string line;
  while (std::getline(file, line) && line.rfind("DATA ascii", 0) != 0) {
  }
  std::vector<Eigen::Vector3f> points;
  while (std::getline(file, line)) {
    std::istringstream values(line);
    Eigen::Vector3f p;
    if (values >> p.x() >> p.y() >> p.z()) points.push_back(p);
  }
  return points;
}

/// A carton and a can, seen from the robot's side and above: some points lie a tenth of a
/// millimeter from each other, some a centimeter.
inline std::vector<Eigen::Vector3f> generatedPoints() {
  constexpr std::size_t kPoints = 852;
  constexpr double kTable = 0.8, kSide = 0.06, kHeight = 0.06, kRadius = 0.033;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<Eigen::Vector3f> points;
  while (points.size() < kPoints) {
    const double a = uniform(random), b = uniform(random);
    const bool is_lid = uniform(random) < 0.4;
    Eigen::Vector3d p;
    if (points.size() % 2 == 0) {  // the carton: its lid, or the side toward the robot
      p = is_lid ? Eigen::Vector3d(kSide * a, kSide * b, kHeight)
                 : Eigen::Vector3d(0, kSide * b, kHeight * a);
      p += Eigen::Vector3d(0.5, -0.15, kTable);
    } else {  // the can: its lid, or the half toward the robot
      const double angle = M_PI * (is_lid ? 2 * a : 0.5 + a), r = is_lid ? std::sqrt(b) : 1;
      p = {kRadius * r * std::cos(angle), kRadius * r * std::sin(angle), is_lid ? 0.1 : 0.1 * b};
      p += Eigen::Vector3d(0.62, -0.05, kTable);
    }
    points.push_back(p.cast<float>());
  }
  return points;
}

inline std::vector<Eigen::Vector3f> perceivedPoints(Source source) {
  return source == Source::Real ? readPcd(realData("fetch_clusters.pcd")) : generatedPoints();
}

}  // namespace afterglow::test
