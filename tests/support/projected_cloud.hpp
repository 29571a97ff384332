/// \file
/// A perceived cloud before the paper's projector: where it stands, and the pixels its points must
/// light.
#pragma once

#include <geometry_msgs/TransformStamped.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <string>
#include <vector>

#include "nodes/conversion/geometry_conversion.hpp"
#include "tests/support/image_measures.hpp"
#include "tests/support/optics.hpp"
#include "tests/support/perceived_points.hpp"
#include "tests/support/projector_info.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::test {

/// In base_link, which stands somewhere in map; the projector looks down on it.
struct ProjectedCloud {
  std::vector<Eigen::Vector3f> points;
  Eigen::Isometry3d T_map_base = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d T_base_projector = Eigen::Isometry3d::Identity();

  explicit ProjectedCloud(Source source) : points(perceivedPoints(source)) {
    std::ofstream(calibration_.path("projector.yaml")) << projectorInfo(source);
    T_map_base.translate(Eigen::Vector3d(1, -2, 0.1));
    T_map_base.rotate(Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ()));
    Eigen::Vector3d center = Eigen::Vector3d::Zero();
    for (const auto& p : points) center += p.cast<double>() / static_cast<double>(points.size());
    const Eigen::Vector3d eye(-0.2, 0.1, 1.5);
    T_base_projector = lookAt<Projector>(eye, center).matrix();
    // The lens throws upwards (cy = 817): the axis passes below what is in the picture's middle.
    T_base_projector.rotate(
        Eigen::AngleAxisd(-std::atan((817.0 - 400) / 1900), Eigen::Vector3d::UnitX()));
  }

  /// A folder with the projector's camera_info, projector.yaml.
  std::string calibration() const { return calibration_.path(""); }

  /// Both as static transforms.
  std::vector<geometry_msgs::TransformStamped> transforms() const {
    std::vector<geometry_msgs::TransformStamped> all(2);
    all[0].header.frame_id = "map";
    all[0].child_frame_id = "base_link";
    all[0].transform = nodes::toTransform(T_map_base);
    all[1].header.frame_id = "base_link";
    all[1].child_frame_id = "projector_optical_frame";
    all[1].transform = nodes::toTransform(T_base_projector);
    return all;
  }

  /// cv::projectPoints' word on every point.
  std::vector<Eigen::Vector2d> pixels() const {
    std::vector<Eigen::Vector3d> optical;
    for (const auto& p : points) {
      optical.emplace_back(T_base_projector.inverse() * p.cast<double>());
    }
    return projectWithOpenCv(viewsonic(), optical);
  }

  /// Every point that lies `apart` pixels from all others, and within the image, is lit where it
  /// should be.
  void expectLit(const render::Image& image, double apart = 7, double tolerance_px = 0.5) const {
    const auto all = pixels();
    int checked = 0;
    for (std::size_t i = 0; i < all.size(); ++i) {
      bool is_alone = all[i].x() > apart && all[i].y() > apart &&
                      all[i].x() < image.width - apart && all[i].y() < image.height - apart;
      for (std::size_t j = 0; j < all.size() && is_alone; ++j) {
        is_alone = i == j || (all[i] - all[j]).lpNorm<Eigen::Infinity>() > apart;
      }
      if (!is_alone) continue;
      ++checked;
      const auto found = centroid(image, all[i], 3);
      ASSERT_TRUE(found) << "dark at " << all[i].transpose();
      EXPECT_LT((*found - all[i]).norm(), tolerance_px) << "at " << all[i].transpose();
    }
    EXPECT_GE(checked, 20);
  }

 private:
  TempFolder calibration_;
};

}  // namespace afterglow::test
