/// \file
/// The part of space that a lens can put on its image, and how long a straight edge may be there.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "calib/lens.hpp"

namespace afterglow::render {

/// Coordinates are normalized: x / z and y / z in the optical frame. Pure values.
class LensDomain {
 public:
  /// No vertex lies closer than this in front of the lens, meters: no projector is sharp there.
  static constexpr double kNear = 0.02;

  explicit LensDomain(const calib::Lens& lens);

  /// Encloses everything that reaches the image, with a small margin.
  const Eigen::Vector2d& min() const { return min_; }
  const Eigen::Vector2d& max() const { return max_; }

  /// Pixels by normalized coordinates, on the axis.
  const Eigen::Vector2d& focal() const { return focal_; }

  /// A regular polygon with this inner radius and these outward normals lies within the fold;
  /// so close that, as the lens's magnification ends there, the difference is not seen.
  double foldInnerRadius() const { return fold_inner_radius_; }
  const std::vector<Eigen::Vector2d>& foldNormals() const { return fold_normals_; }

  /// Returns true if the lens bends the edge by less than kMaxSag somewhere near these radii.
  bool isStraight(const Eigen::Vector2d& from, const Eigen::Vector2d& to) const;
  /// Returns true if that holds for every edge within a rectangle.
  bool isStraightWithin(const Eigen::Vector2d& low, const Eigen::Vector2d& high) const;

 private:
  static constexpr double kMaxSag = 0.08;  // px; below the promised 0.1
  bool isStraight(double square_length, double radius) const;
  void measureBox(const calib::Lens& lens);
  void measureBend(const calib::Lens& lens);
  bool isStraightInFisheye(const Eigen::Vector2d& from, const Eigen::Vector2d& to) const;

  Eigen::Vector2d min_, max_;
  Eigen::Vector2d focal_;
  double fold_inner_radius_;
  std::vector<Eigen::Vector2d> fold_normals_;
  double radius_step_ = 1;
  std::optional<calib::Lens> fisheye_;     ///< the lens, if it is one
  std::vector<double> max_square_length_;  ///< px^2, by radius; empty: a lens that bends nothing
};

}  // namespace afterglow::render
