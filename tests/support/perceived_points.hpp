/// \file
/// The points of an ASCII PCD file.
#pragma once

#include <Eigen/Core>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

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

}  // namespace afterglow::test
