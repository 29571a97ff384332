/// \file
/// What a depth camera makes of a table with a box on it, in a frame of its own.
#pragma once

#include <sensor_msgs/PointCloud2.h>

#include <Eigen/Geometry>
#include <random>
#include <string>
#include <vector>

#include "tests/support/cloud_messages.hpp"
#include "tests/support/optics.hpp"

namespace afterglow::test {

/// A table of 1 m x 0.6 m whose middle is (0.9, 0.1, 0.7) of the map, a box of 0.2 m x 0.2 m x 0.1
/// m in its middle, the floor beside it; 2 mm of noise. The map is called World here.
class TableCloud {
 public:
  static constexpr double kHeight = 0.7, kBox = 0.1;

  sensor_msgs::PointCloud2 message(const std::string& frame, double lifted = 0) const {
    std::mt19937 random(1);
    std::normal_distribution<double> noise(0, 0.002);
    const Eigen::Isometry3d T_camera_map = T_map_camera.inverse();
    std::vector<Eigen::Vector3f> points;
    for (double x = 0; x <= 1.8; x += 0.008) {
      for (double y = -0.6; y <= 0.8; y += 0.008) {
        const double dx = std::abs(x - 0.9), dy = std::abs(y - 0.1);
        const double height = dx < 0.1 && dy < 0.1   ? kHeight + kBox + lifted
                              : dx < 0.5 && dy < 0.3 ? kHeight + lifted
                                                     : 0;
        const Eigen::Vector3d p(x, y, height + noise(random));
        points.push_back((T_camera_map * p).cast<float>());
      }
    }
    return cloudMessage(frame, points);
  }

  Eigen::Isometry3d T_map_camera = lookAt<Projector>({0, 0, 1.3}, {0.9, 0, 0.6}).matrix();
};

}  // namespace afterglow::test
