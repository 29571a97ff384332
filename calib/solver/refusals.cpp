#include "calib/solver/refusals.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/degrees.hpp"

namespace afterglow::calib {
namespace {

/// Of a picture 1280 px wide.
constexpr double kLargestError_px = 2, kLargestMisfit_px = 1, kReferenceWidth_px = 1280;
constexpr double kLargestAspectError = 0.015, kLargestSkew = 0.5 / kDegrees;
/// Principal point, in pictures from the picture's middle: the largest lens shift there is.
constexpr double kLargestShift = 1.5;
constexpr double kLargestFold = 0.05;
constexpr double kLargestPrintError = 0.002;
/// Printers do not stretch that much one way only.
constexpr double kNoPrinter = 0.02;
/// Half axis of a 95 % ellipse in standard deviations: chi-square with two degrees of freedom.
const double kEllipse95 = std::sqrt(5.991);

/// Where light through a projector pixel meets the view's board: camera frame. Empty if nowhere.
std::optional<Eigen::Vector3d> meetingPoint(const ProjectorEstimate& estimate,
                                            const PosedView& view, const Eigen::Vector2d& pixel) {
  const auto ray = unproject(estimate.projector, pixel);
  if (!ray) return std::nullopt;
  const Eigen::Isometry3d& T = estimate.T_camera_projector.matrix();
  const Eigen::Vector3d direction = T.linear() * *ray;
  const Eigen::Vector3d to_board = view.T_camera_board.matrix().translation() - T.translation();
  const double distance = view.normal().dot(to_board) / view.normal().dot(direction);
  if (!(distance > 0)) return std::nullopt;
  return Eigen::Vector3d(T.translation() + distance * direction);
}

double high95(std::vector<double>& values) {
  const auto high = values.begin() + std::ptrdiff_t((values.size() - 1) * 95 / 100);
  std::nth_element(values.begin(), high, values.end());
  return *high;
}

double scaledLimit_px(double limit_px, const Lens& projector) {
  return limit_px * std::max(1.0, projector.width / kReferenceWidth_px);
}

}  // namespace

PredictedError predictedError(const ProjectorEstimate& estimate,
                              const std::vector<PosedView>& views) {
  constexpr double kUnknown = std::numeric_limits<double>::infinity();
  const Rigid<Projector, Camera> T_projector_camera = estimate.T_camera_projector.inverse();
  std::vector<double> px, mm;
  for (const PosedView& view : views) {
    // One corner of each tag tells as much as all four.
    for (std::size_t i = 0; i < view.lit_px.size(); i += 4) {
      const auto p_camera = meetingPoint(estimate, view, view.lit_px[i]);
      const auto predicted = p_camera ? predictPixel(estimate, *p_camera) : std::nullopt;
      if (!predicted || !predicted->covariance.allFinite()) {
        px.push_back(kUnknown);
        mm.push_back(kUnknown);
        continue;
      }
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(predicted->covariance);
      px.push_back(kEllipse95 * std::sqrt(std::max(0.0, axes.eigenvalues()[1])));
      const double distance = (T_projector_camera * *p_camera).z();
      mm.push_back(px.back() * 1000 * distance / estimate.projector.K(0, 0));
    }
  }
  if (px.empty()) return {kUnknown, kUnknown};
  return {high95(px), high95(mm)};
}

std::vector<std::string> uncertaintyRefusals(const ProjectorEstimate& estimate,
                                             const std::vector<PosedView>& views) {
  const double error = predictedError(estimate, views).px;
  const double limit = scaledLimit_px(kLargestError_px, estimate.projector);
  if (error <= limit) return {};
  return {
      fmt::format("the views leave the projection uncertain by {:.3g} px (95 %), at most {:.3g} is "
                  "useful: take more views, at other distances and tilts",
                  error, limit)};
}

std::vector<std::string> pixelShapeRefusals(const PixelShape& shape, const Lens& projector) {
  constexpr const char* kAdvice =
      "keystone correction or a resolution that is not the projector's own seems to be switched "
      "on: switch both off and calibrate again (if they are off: is the camera_info this "
      "camera's?)";
  std::vector<std::string> reasons;
  const double stretch = std::abs(std::log(shape.aspect));
  if (stretch > kLargestAspectError && stretch > 4 * shape.aspect_sigma) {
    reasons.push_back(
        fmt::format("the projector's pixels are not square ({:.1f} % {}): {}",
                    100 * (std::exp(stretch) - 1),
                    shape.aspect > 1 ? "higher than wide" : "wider than high", kAdvice));
  }
  const double skew = std::abs(shape.skew_rad);
  if (skew > kLargestSkew && skew > 4 * shape.skew_sigma_rad) {
    reasons.push_back(fmt::format("the projector's pixel columns lean by {:.1f} deg: {}",
                                  skew * kDegrees, kAdvice));
  }
  const Eigen::Vector2d shift((projector.K(0, 2) + 0.5) / projector.width - 0.5,
                              (projector.K(1, 2) + 0.5) / projector.height - 0.5);
  if (shift.cwiseAbs().maxCoeff() > kLargestShift) {
    reasons.push_back(
        fmt::format("the projector's axis is {:.1f} pictures off the middle, more than any lens "
                    "shift: {}",
                    shift.cwiseAbs().maxCoeff(), kAdvice));
  }
  return reasons;
}

std::vector<std::string> misfitRefusals(double held_out_rms_px, const Lens& projector) {
  const double limit = scaledLimit_px(kLargestMisfit_px, projector);
  if (held_out_rms_px <= limit) return {};
  return {
      fmt::format("views that were left out are {:.2f} px off, at most {:.2f} is useful: is the "
                  "board flat and the camera calibrated, is a keystone or corner correction "
                  "switched on, did camera or projector move?",
                  held_out_rms_px, limit)};
}

double foldedShare(const Lens& lens) {
  constexpr int kSteps = 40;
  int folded = 0;
  for (int row = 0; row <= kSteps; ++row) {
    for (int column = 0; column <= kSteps; ++column) {
      const Eigen::Vector2d pixel(double(column) / kSteps * (lens.width - 1),
                                  double(row) / kSteps * (lens.height - 1));
      if (!unproject(lens, pixel)) ++folded;
    }
  }
  return double(folded) / ((kSteps + 1) * (kSteps + 1));
}

std::vector<std::string> foldRefusals(const Lens& projector) {
  const double folded = foldedShare(projector);
  if (folded <= kLargestFold) return {};
  return {
      fmt::format("the distortion found folds back inside the picture ({:.0f} % of it cannot be "
                  "reached): hold the board into the picture's corners too, where it is decided",
                  100 * folded)};
}

std::vector<std::string> printRefusals(const Board& board, const std::optional<PrintStretch>& seen,
                                       const std::optional<double>& measured_ruler_m) {
  std::vector<std::string> reasons;
  if (seen && std::abs(seen->stretch) > kLargestPrintError &&
      std::abs(seen->stretch) > 4 * seen->sigma) {
    reasons.push_back(
        fmt::format("the board is printed {:.2f} % too {} for its height: {}",
                    100 * std::abs(seen->stretch), seen->stretch > 0 ? "wide" : "narrow",
                    std::abs(seen->stretch) > kNoPrinter
                        ? "is the layout (board.yaml) another board's?"
                        : "print it without fitting it to the page, or on another printer; "
                          "measure both sides"));
  }
  if (!measured_ruler_m) return reasons;
  if (!(board.ruler_m > 0)) {
    reasons.push_back("a measured ruler is given, and the board's layout has none");
    return reasons;
  }
  const double scale = *measured_ruler_m / board.ruler_m;
  if (std::abs(scale - 1) <= kLargestPrintError) return reasons;
  if (!(scale > 0.5 && scale < 2)) {
    reasons.push_back(
        fmt::format("the measured ruler is {:.6g} mm long and the layout's {:.6g} mm: is its "
                    "length given in another unit, or the layout another board's?",
                    1000 * *measured_ruler_m, 1000 * board.ruler_m));
    return reasons;
  }
  reasons.push_back(
      fmt::format("the board is printed at {:.2f} % of its size (its ruler measures {:.2f} mm, "
                  "not {:.2f} mm): print it at 100 %, \"actual size\", not fitted to the page",
                  100 * scale, 1000 * *measured_ruler_m, 1000 * board.ruler_m));
  return reasons;
}

}  // namespace afterglow::calib
