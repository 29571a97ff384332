#include "tests/support/sample_calibration.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <random>

namespace afterglow::test {
namespace {

using calib::Calibration;
using calib::CornerResidual;
using calib::kCalibrationParameters;
using calib::Lens;
using calib::ViewResult;

constexpr double kNoise_px = 0.12;
constexpr double kTagPitch_px = 80, kTag_px = 48;

Eigen::Matrix3d pinhole(double f, double cx, double cy) {
  Eigen::Matrix3d K;
  K << f, 0, cx, 0, f, cy, 0, 0, 1;
  return K;
}

Rigid<Camera, Projector> samplePose() {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = Eigen::Vector3d(0.184, -0.043, 0.021);
  T.linear() = (Eigen::AngleAxisd(-0.12, Eigen::Vector3d::UnitY()) *
                Eigen::AngleAxisd(-0.19, Eigen::Vector3d::UnitX()))
                   .toRotationMatrix();
  return Rigid<Camera, Projector>(T);
}

/// A board in the projector's beam, its middle lit by `pixel`, tilted by angles about x and y.
Rigid<Projector, Surface> boardAt(const Lens& projector, const Eigen::Vector2d& pixel,
                                  double distance_m, double about_x, double about_y) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = *calib::unproject(projector, pixel) * distance_m;
  T.linear() = (Eigen::AngleAxisd(3.14159265358979 + about_x, Eigen::Vector3d::UnitX()) *
                Eigen::AngleAxisd(about_y, Eigen::Vector3d::UnitY()))
                   .toRotationMatrix();
  return Rigid<Projector, Surface>(T);
}

class Maker {
 public:
  Maker() {
    calibration_.estimate.projector =
        calib::makeLens(1280, 800, pinhole(1903.27, 633.1, 817.4), {-0.082, 0.031, 6e-4, -4e-4});
    calibration_.estimate.T_camera_projector = samplePose();
    calibration_.camera =
        calib::makeLens(1280, 960, pinhole(1001.3, 641.7, 476.2), {-0.11, 0.05, 1e-4, 2e-4, 0.0});
  }

  Calibration make() {
    for (int i = 0; i < 16; ++i) addView(i);
    leaveOut(14, "shows the pattern of the view before; wait longer after changing the picture");
    leaveOut(15, "tags are mirrored; switch \"rear projection\" off in the projector's menu");
    calibration_.views[3].residuals[60].is_outlier = true;
    calibration_.views[3].residuals[60].error_px = Eigen::Vector2d(1.9, -2.4);
    calibration_.views[3].residuals[60].pattern_error_px = Eigen::Vector2d(4.1, -3.6);
    setErrors();
    setCovariance();
    calibration_.warnings = {"the lower left of the picture is not covered; hold the board there"};
    return calibration_;
  }

 private:
  double noise() { return kNoise_px * normal_(random_); }

  void addView(int index) {
    const Lens& projector = calibration_.estimate.projector;
    const Eigen::Vector2d middle(250 + 260 * (index % 4), 210 + 130 * (index / 4));
    const auto T_projector_board =
        boardAt(projector, middle, 0.9 + 0.09 * ((index * 5) % 8), 0.45 * std::sin(1.7 * index),
                0.5 * std::cos(2.3 * index));
    ViewResult view;
    view.name = "view_" + std::string(index < 10 ? "0" : "") + std::to_string(index);
    view.is_used = true;
    view.T_camera_board = calibration_.estimate.T_camera_projector * T_projector_board;
    addPrinted(view);
    addProjected(view, T_projector_board);
    calibration_.views.push_back(view);
  }

  void addPrinted(ViewResult& view) {
    const Eigen::Vector2d half(0.297, 0.21);
    for (int i = 0; i < 40; ++i) {
      const double along = -1 + 2 * (i % 10) / 9.0, side = i % 20 < 10 ? 1 : -1;
      const Eigen::Vector2d share =
          i < 20 ? Eigen::Vector2d(along, side * 0.95) : Eigen::Vector2d(side * 0.96, along * 0.8);
      const Eigen::Vector3d p_board(half.x() * share.x(), half.y() * share.y(), 0);
      const auto pixel = calib::project(calibration_.camera, view.T_camera_board * p_board);
      if (!pixel) continue;
      CornerResidual corner;
      corner.tag_id = i / 4;
      corner.corner = i % 4;
      corner.is_projected = false;
      corner.camera_px = *pixel;
      corner.error_px = Eigen::Vector2d(0.4 * noise(), 0.4 * noise());
      view.residuals.push_back(corner);
    }
  }

  void addProjected(ViewResult& view, const Rigid<Projector, Surface>& T_projector_board) {
    const Lens& projector = calibration_.estimate.projector;
    const Eigen::Vector3d n = T_projector_board.matrix().linear().col(2);
    const Eigen::Vector3d origin = T_projector_board.matrix().translation();
    for (int i = 0; i < 160 * 4; ++i) {
      const int tag = i / 4, corner_index = i % 4;
      const Eigen::Vector2d in_tag(corner_index == 1 || corner_index == 2 ? kTag_px : 0,
                                   corner_index > 1 ? kTag_px : 0);
      const Eigen::Vector2d pixel =
          Eigen::Vector2d(tag % 16, tag / 16) * kTagPitch_px + Eigen::Vector2d(16, 16) + in_tag;
      const auto ray = calib::unproject(projector, pixel);
      if (!ray) continue;
      const Eigen::Vector3d p_projector = *ray * (n.dot(origin) / n.dot(*ray));
      const Eigen::Vector3d p_board = T_projector_board.inverse() * p_projector;
      if (std::abs(p_board.x()) > 0.22 || std::abs(p_board.y()) > 0.14) continue;
      const Eigen::Vector3d p_camera = calibration_.estimate.T_camera_projector * p_projector;
      const auto camera_px = calib::project(calibration_.camera, p_camera);
      if (!camera_px) continue;
      CornerResidual corner;
      corner.tag_id = calib::kFirstPatternId + tag;
      corner.corner = corner_index;
      corner.camera_px = *camera_px;
      corner.pattern_px = pixel;
      corner.pattern_error_px = Eigen::Vector2d(noise(), noise());
      corner.error_px = 0.5 * corner.pattern_error_px;
      view.residuals.push_back(corner);
      points_.push_back(p_camera);
      count(pixel);
    }
  }

  void count(const Eigen::Vector2d& pixel) {
    const int column = static_cast<int>(pixel.x() * calib::Coverage::kColumns / 1280);
    const int row = static_cast<int>(pixel.y() * calib::Coverage::kRows / 800);
    ++calibration_.coverage.corners.at(
        static_cast<std::size_t>(row * calib::Coverage::kColumns + column));
  }

  void leaveOut(std::size_t index, const std::string& reason) {
    calibration_.views[index].is_used = false;
    calibration_.views[index].reason = reason;
    calibration_.views[index].residuals.clear();
  }

  void setErrors() {
    int index = 0;
    for (ViewResult& view : calibration_.views) {
      if (!view.is_used) continue;
      view.projected_rms_px = 0.15 + 0.006 * (index * 7 % 5);
      view.held_out_px = view.projected_rms_px * (1.1 + 0.08 * (index * 3 % 4));
      view.held_out_mm = *view.held_out_px * 0.62;
      ++index;
    }
    calibration_.held_out_rms_px = 0.2034;
    calibration_.held_out_rms_mm = 0.1261;
    calibration_.training_rms_px = 0.1631;
    calibration_.board_rms_px = 0.0687;
    calibration_.light = {{1, 0.041, 0.078}, {2, 0.087, 0.083}, {3, 0.14, 0.089}};
    calibration_.print_mm_per_permille = 0.19;
    calibration_.board_shape.half_m = Eigen::Vector2d(0.297, 0.21);
    calibration_.board_shape.parameters[1] = 0.0011;
  }

  /// Of all projected corners, with their points taken as known.
  void setCovariance() {
    using Vector = Eigen::Matrix<double, kCalibrationParameters, 1>;
    Eigen::Matrix<double, kCalibrationParameters, kCalibrationParameters> information;
    information.setZero();
    const auto moved = [&](const Vector& by, const Eigen::Vector3d& p_camera) {
      Lens lens = calibration_.estimate.projector;
      lens.K(0, 0) += by[0];
      lens.K(1, 1) += by[1];
      lens.K(0, 2) += by[2];
      lens.K(1, 2) += by[3];
      for (std::size_t i = 0; i < 8; ++i) lens.D[i] += by[4 + static_cast<int>(i)];
      Eigen::Isometry3d T = calibration_.estimate.T_camera_projector.matrix();
      const Eigen::Vector3d w = by.segment<3>(12);
      if (w.norm() > 0) T.linear() *= Eigen::AngleAxisd(w.norm(), w.normalized()).matrix();
      T.translation() += by.segment<3>(15);
      return *calib::project(lens, T.inverse() * p_camera);
    };
    for (const Eigen::Vector3d& p_camera : points_) {
      Eigen::Matrix<double, 2, kCalibrationParameters> J;
      for (int i = 0; i < kCalibrationParameters; ++i) {
        const Vector by = (i < 4 ? 1e-2 : 1e-5) * Vector::Unit(i);
        J.col(i) = (moved(by, p_camera) - moved(-by, p_camera)) / (2 * by[i]);
        if (i >= 8 && i < 12) J.col(i).setZero();  // plumb_bob without k3
      }
      information += J.transpose() * J / (kNoise_px * kNoise_px);
    }
    for (int i = 8; i < 12; ++i) information(i, i) = 1;
    calibration_.estimate.covariance = information.inverse();
    for (int i = 8; i < 12; ++i) calibration_.estimate.covariance(i, i) = 0;
    const auto covariance = calibration_.estimate.covariance.eval();
    calibration_.estimate.covariance = 0.5 * (covariance + covariance.transpose());
  }

  Calibration calibration_;
  std::vector<Eigen::Vector3d> points_;
  std::mt19937 random_{7};
  std::normal_distribution<double> normal_;
};

}  // namespace

Calibration sampleCalibration() { return Maker().make(); }

std::vector<calib::Photographs> samplePhotographs(const Calibration& calibration) {
  std::vector<calib::Photographs> photographs;
  for (const ViewResult& view : calibration.views) {
    calib::Photographs each;
    each.name = view.name;
    each.pattern.width = calibration.camera.width;
    each.pattern.height = calibration.camera.height;
    for (int y = 0; y < each.pattern.height; ++y) {
      for (int x = 0; x < each.pattern.width; ++x) {
        each.pattern.pixels.push_back(static_cast<std::uint8_t>(60 + x / 16 + y / 12));
      }
    }
    for (const CornerResidual& corner : view.residuals) {
      for (int i = 0; i < 144; ++i) {
        const int x = static_cast<int>(corner.camera_px.x()) + i % 12;
        const int y = static_cast<int>(corner.camera_px.y()) + i / 12;
        if (x < 0 || y < 0 || x >= each.pattern.width || y >= each.pattern.height) continue;
        each.pattern.pixels[static_cast<std::size_t>(y * each.pattern.width + x)] =
            corner.is_projected ? 235 : 25;
      }
    }
    photographs.push_back(each);
  }
  return photographs;
}

}  // namespace afterglow::test
