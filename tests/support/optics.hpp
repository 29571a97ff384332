/// \file
/// Lenses and poses for tests, and OpenCV's word on where points land.
#pragma once

#include <Eigen/Geometry>
#include <opencv2/calib3d.hpp>
#include <random>
#include <vector>

#include "calib/frames.hpp"
#include "calib/lens.hpp"

namespace afterglow::test {

inline calib::Lens lens(int width, int height, double f, double cx, double cy,
                        const std::vector<double>& D = {}) {
  Eigen::Matrix3d K;
  K << f, 0, cx, 0, f, cy, 0, 0, 1;
  return calib::makeLens(width, height, K, D);
}

/// Kannala-Brandt; D has four numbers.
inline calib::Lens fisheye(int width, int height, double f, double cx, double cy,
                           const std::vector<double>& D) {
  Eigen::Matrix3d K;
  K << f, 0, cx, 0, f, cy, 0, 0, 1;
  return calib::makeLens(width, height, K, D, calib::LensModel::Equidistant);
}

/// The paper's projector: the principal point lies below the image.
inline calib::Lens viewsonic(const std::vector<double>& D = {}) {
  return lens(1280, 800, 1900, 640, 817, D);
}

inline cv::Mat cvK(const calib::Lens& lens) {
  cv::Mat K(3, 3, CV_64F);
  for (int i = 0; i < 9; ++i) K.at<double>(i / 3, i % 3) = lens.K(i / 3, i % 3);
  return K;
}

/// cv::projectPoints or cv::fisheye::projectPoints; points in the optical frame.
inline std::vector<Eigen::Vector2d> projectWithOpenCv(
    const calib::Lens& lens, const std::vector<Eigen::Vector3d>& points_optical) {
  if (points_optical.empty()) return {};
  std::vector<cv::Point3d> points;
  for (const Eigen::Vector3d& p : points_optical) points.emplace_back(p.x(), p.y(), p.z());
  std::vector<cv::Point2d> pixels;
  const cv::Mat zero = cv::Mat::zeros(3, 1, CV_64F);
  if (lens.model == calib::LensModel::Equidistant) {
    cv::fisheye::projectPoints(points, pixels, zero, zero, cvK(lens),
                               std::vector<double>(lens.D.begin(), lens.D.begin() + 4),
                               lens.K(0, 1) / lens.K(0, 0));
  } else {
    const std::vector<double> D(lens.D.begin(), lens.D.end());
    cv::projectPoints(points, zero, zero, cvK(lens), D, pixels);
  }
  std::vector<Eigen::Vector2d> result;
  for (const cv::Point2d& pixel : pixels) result.emplace_back(pixel.x, pixel.y);
  return result;
}

inline Eigen::Matrix3d randomRotation(std::mt19937& random) {
  std::normal_distribution<double> normal;
  Eigen::Quaterniond q(normal(random), normal(random), normal(random), normal(random));
  return q.normalized().toRotationMatrix();
}

/// An optical frame at `eye` that looks at `target`, the image's top toward `up`.
template <typename Frame>
Rigid<World, Frame> lookAt(const Eigen::Vector3d& eye, const Eigen::Vector3d& target,
                           const Eigen::Vector3d& up = Eigen::Vector3d::UnitZ()) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  const Eigen::Vector3d z = (target - eye).normalized();
  const Eigen::Vector3d x = z.cross(up).normalized();
  T.linear().col(0) = x;
  T.linear().col(1) = z.cross(x);
  T.linear().col(2) = z;
  T.translation() = eye;
  return Rigid<World, Frame>(T);
}

}  // namespace afterglow::test
