#include "nodes/projector/deskew.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace afterglow::nodes {
namespace {

constexpr double kKnotSpacing = 0.01;  // s
constexpr double kMostKnots = 100;

struct Knot {
  Eigen::Vector3d position;
  Eigen::Quaterniond rotation;
};

/// Empty beyond what a ros::Time can say.
std::optional<ros::Time> later(ros::Time stamp, double seconds) {
  constexpr std::int64_t kEnd = (std::int64_t{1} << 32) * 1'000'000'000;
  const std::int64_t ns = static_cast<std::int64_t>(stamp.toNSec()) + std::llround(seconds * 1e9);
  if (ns <= 0 || ns >= kEnd) return std::nullopt;
  ros::Time time;
  time.fromNSec(static_cast<std::uint64_t>(ns));
  return time;
}

}  // namespace

std::optional<render::PointList> deskew(const render::PointList& points, const Sweep& sweep,
                                        const std::string& frame, ros::Time stamp,
                                        FrameLookup& frames) {
  const double spans = std::clamp(std::ceil(std::abs(sweep.last_s) / kKnotSpacing), 1., kMostKnots);
  std::vector<Knot> knots;
  std::optional<Eigen::Isometry3d> T_first_fixed;
  for (double i = 0; i <= spans; ++i) {
    const auto time = later(stamp, sweep.last_s * i / spans);
    const auto T_fixed_frame = time ? frames.at(frame, *time) : std::nullopt;
    if (!T_fixed_frame) return std::nullopt;
    if (!T_first_fixed) T_first_fixed = T_fixed_frame->inverse();
    const Eigen::Isometry3d T_first_now = *T_first_fixed * *T_fixed_frame;
    knots.push_back({T_first_now.translation(), Eigen::Quaterniond(T_first_now.linear())});
  }
  render::PointList placed;
  placed.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double along = std::clamp(sweep.seconds[i] / sweep.last_s, 0.0, 1.0) * spans;
    const auto k = static_cast<std::size_t>(std::min(std::floor(along), spans - 1));
    const double share = along - static_cast<double>(k);
    const Eigen::Vector3d position =
        knots[k].position + share * (knots[k + 1].position - knots[k].position);
    const Eigen::Quaterniond rotation = knots[k].rotation.slerp(share, knots[k + 1].rotation);
    placed.emplace_back((rotation * points[i].cast<double>() + position).cast<float>());
  }
  return placed;
}

}  // namespace afterglow::nodes
