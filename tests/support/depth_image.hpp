/// \file
/// What a depth camera of structured light makes of a table with things on it.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include "tests/support/labeled_cloud.hpp"

namespace afterglow::test {

/// 640 x 480 rays, in the camera's optical frame. Far away, where the camera's own light does not
/// reach, and here and there, nothing was measured.
class DepthImage {
 public:
  static constexpr std::uint32_t kNothing = 0, kTable = 1, kThing = 2;

  LabeledCloud cloud() const {
    std::mt19937 random(3);
    std::normal_distribution<double> noise(0, kDisparityNoise_px);
    LabeledCloud image;
    for (int v = 0; v < 480; ++v) {
      for (int u = 0; u < 640; ++u) {
        const Eigen::Vector3d ray((u - 319.5) / kFocal, (v - 239.5) / kFocal, 1);
        const Hit hit = meet(Eigen::Vector3d::Zero(), ray);
        const double disparity = kFocal * kBase_m / hit.way + noise(random);
        const double measured = kFocal * kBase_m / (std::round(8 * disparity) / 8);
        const bool is_measured =
            hit.way < kReach_m && random() % 100 > 0 && isLit(ray * hit.way);
        image.points.emplace_back(is_measured ? Eigen::Vector3d(ray * measured)
                                              : Eigen::Vector3d::Constant(std::nan("")));
        image.labels.push_back(hit.label);
      }
    }
    return image;
  }

  /// The camera looks down at the table: its middle is 1.1 m away.
  Eigen::Isometry3d T_camera_table = [] {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translate(Eigen::Vector3d(0.05, -0.02, 1.1));
    T.rotate(Eigen::AngleAxisd(2.4, Eigen::Vector3d::UnitX()));
    return T;
  }();

 private:
  static constexpr double kFocal = 525, kBase_m = 0.075, kDisparityNoise_px = 0.05,
                          kReach_m = 2;
  static constexpr double kFloor = -0.72;  ///< below the table
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

  struct Hit {
    double way = kInfinity;
    std::uint32_t label = kNothing;
  };
  /// An upright box or cylinder on the table.
  struct Thing {
    double x, y, radius, height;  ///< of a box: half its side
    bool is_round;
  };
  const std::vector<Thing> things_ = {{-0.2, 0.05, 0.05, 0.2, false},
                                      {0.12, 0.1, 0.035, 0.12, true},
                                      {0.25, -0.08, 0.08, 0.06, false},
                                      {-0.02, -0.12, 0.04, 0.1, true}};

  static void keepNearer(Hit& hit, double way, std::uint32_t label) {
    if (way > 1e-6 && way < hit.way) hit = {way, label};
  }

  /// Between which ways a ray is within a thing's outline, seen from above.
  static std::pair<double, double> within(const Thing& thing, const Eigen::Vector2d& from,
                                          const Eigen::Vector2d& direction) {
    const Eigen::Vector2d o = from - Eigen::Vector2d(thing.x, thing.y);
    if (!thing.is_round) {
      const Eigen::Array2d a = (-thing.radius - o.array()) / direction.array();
      const Eigen::Array2d b = (thing.radius - o.array()) / direction.array();
      return {a.min(b).maxCoeff(), a.max(b).minCoeff()};
    }
    const double middle = -o.dot(direction) / direction.squaredNorm();
    const double aside = (o + middle * direction).norm();
    if (aside > thing.radius) return {kInfinity, -kInfinity};
    const double half =
        std::sqrt(thing.radius * thing.radius - aside * aside) / direction.norm();
    return {middle - half, middle + half};
  }

  /// The first surface on a ray, both in the camera's frame.
  Hit meet(const Eigen::Vector3d& eye, const Eigen::Vector3d& ray) const {
    const Eigen::Isometry3d T_table_camera = T_camera_table.inverse();
    const Eigen::Vector3d o = T_table_camera * eye, d = T_table_camera.linear() * ray;
    Hit hit;
    keepNearer(hit, (kFloor - o.z()) / d.z(), kNothing);
    const Eigen::Vector3d on_table = o - d * (o.z() / d.z());
    if (std::abs(on_table.x()) < 0.6 && std::abs(on_table.y()) < 0.4) {
      keepNearer(hit, -o.z() / d.z(), kTable);
    }
    for (const Thing& thing : things_) {
      const auto [first, last] = within(thing, o.head<2>(), d.head<2>());
      const double top = (thing.height - o.z()) / d.z(), bottom = -o.z() / d.z();
      const double enters = std::max(first, std::min(top, bottom));
      if (enters < std::min(last, std::max(top, bottom))) keepNearer(hit, enters, kThing);
    }
    return hit;
  }

  /// Whether the camera's own light, which comes from beside it, reaches a point.
  bool isLit(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d lamp(kBase_m, 0, 0);
    return meet(lamp, p - lamp).way > 1 - 1e-6;
  }
};

}  // namespace afterglow::test
