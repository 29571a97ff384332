/// \file
/// The places where rays of a lens meet a surface, and how far light lands from where it should.
#pragma once

#include <optional>
#include <vector>

#include "calib/frames.hpp"
#include "calib/lens.hpp"

namespace afterglow::calib {

/// Returns the place where the pixel's ray meets the surface's z = 0 plane, meters. Empty if the
/// pixel has no ray, or the ray runs along the plane or away from it. Pure. `Frame` is Camera or
/// Projector.
std::optional<Eigen::Vector2d> landing(const Lens& lens, const Eigen::Vector2d& pixel,
                                       const Eigen::Isometry3d& T_optical_surface);
template <typename Frame>
std::optional<Eigen::Vector2d> landing(const Lens& lens, const Eigen::Vector2d& pixel,
                                       const Rigid<Frame, Surface>& T_optical_surface) {
  return landing(lens, pixel, T_optical_surface.matrix());
}

/// Returns true if the point lies in the polygon, by the even-odd rule.
inline bool isInside(const std::vector<Eigen::Vector2d>& polygon, const Eigen::Vector2d& p) {
  bool inside = false;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d &a = polygon[i], &b = polygon[i == 0 ? polygon.size() - 1 : i - 1];
    if ((a.y() > p.y()) == (b.y() > p.y())) continue;
    if (p.x() < a.x() + (b.x() - a.x()) * (p.y() - a.y()) / (b.y() - a.y())) inside = !inside;
  }
  return inside;
}

/// The error of one corner of a tag of light.
struct LandingError {
  int tag_id = 0;
  int corner = 0;
  Eigen::Vector2d wanted, seen;  ///< places on the surface, meters

  double mm() const { return 1000 * (seen - wanted).norm(); }
};

struct ErrorSummary {
  int corners = 0;
  double median_mm = 0, p95_mm = 0, max_mm = 0, rms_mm = 0;
};

/// Quantiles as numpy has them (linear between ranks). All zero without errors.
ErrorSummary summarize(const std::vector<LandingError>& errors);

}  // namespace afterglow::calib
