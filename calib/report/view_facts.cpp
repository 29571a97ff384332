#include "calib/number_text.hpp"
#include "calib/report/view_facts.hpp"

#include <algorithm>
#include <cmath>

namespace afterglow::calib {
namespace {

/// Below this a board faces the projector: the direction of its tilt means nothing.
constexpr double kFacing_deg = 3;

std::string arrow(const Eigen::Vector3d& n_projector) {
  static const char* const kArrows[] = {"→", "↘", "↓", "↙", "←", "↖", "↑", "↗"};
  const double turns = std::atan2(n_projector.y(), n_projector.x()) * kDegrees / 45;
  return kArrows[(static_cast<int>(std::lround(turns)) + 8) % 8];
}

struct Plane {
  Eigen::Vector3d p_projector, n_projector;
};

std::optional<Eigen::Vector3d> hit(const Lens& projector, const Eigen::Vector2d& pixel,
                                   const Plane& plane) {
  const auto ray = unproject(projector, pixel);
  if (!ray) return std::nullopt;
  const double scale = plane.n_projector.dot(plane.p_projector) / plane.n_projector.dot(*ray);
  if (!std::isfinite(scale)) return std::nullopt;
  return (*ray * scale).eval();
}

/// Root mean squares' ratio over the view's projected corners.
std::optional<double> mmPerPixel(const ViewResult& view, const Lens& projector,
                                 const Plane& board) {
  double mm2 = 0, px2 = 0;
  for (const CornerResidual& corner : view.residuals) {
    if (!corner.is_projected || corner.is_outlier) continue;
    const auto expected = hit(projector, corner.pattern_px, board);
    const auto seen = hit(projector, corner.pattern_px + corner.pattern_error_px, board);
    if (!expected || !seen) continue;
    mm2 += 1e6 * (*seen - *expected).squaredNorm();
    px2 += corner.pattern_error_px.squaredNorm();
  }
  if (!(px2 > 0)) return std::nullopt;
  return std::sqrt(mm2 / px2);
}

}  // namespace

ViewFacts factsOf(const ViewResult& view, const ProjectorEstimate& estimate) {
  ViewFacts facts;
  const Rigid<Projector, Surface> T_projector_board =
      estimate.T_camera_projector.inverse() * view.T_camera_board;
  const Plane board{T_projector_board.matrix().translation(),
                    T_projector_board.matrix().linear().col(2)};
  facts.distance_m = board.p_projector.norm();
  facts.tilt_deg = std::acos(std::clamp(-board.n_projector.z(), -1.0, 1.0)) * kDegrees;
  if (facts.tilt_deg >= kFacing_deg) facts.turned = arrow(board.n_projector);
  for (const CornerResidual& corner : view.residuals) {
    facts.outliers += corner.is_outlier ? 1 : 0;
  }
  const auto scale = mmPerPixel(view, estimate.projector, board);
  if (scale) facts.training_mm = view.projected_rms_px * *scale;
  return facts;
}

int usedViews(const Calibration& calibration) {
  return static_cast<int>(std::count_if(calibration.views.begin(), calibration.views.end(),
                                        [](const ViewResult& view) { return view.is_used; }));
}

}  // namespace afterglow::calib
