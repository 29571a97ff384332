#include "nodes/projector/light_offset.hpp"

#include <algorithm>

namespace afterglow::nodes {
namespace {

const Eigen::Vector3d kAhead(0, 0, LightOffset::kReach_m);

}  // namespace

void LightOffset::add(const Rigid<Projector, World>& drawn, std::int64_t light_ns) {
  waiting_.push_back({drawn.inverse() * kAhead, light_ns});
  if (waiting_.size() > kKept) waiting_.pop_front();  // tf has ended
}

void LightOffset::compare(FrameLookup& frames, const std::string& frame) {
  const auto newest = frames.newest(frame);
  if (!newest) return;
  while (!waiting_.empty() &&
         (newest->stamp_ns == 0 || waiting_.front().light_ns <= newest->stamp_ns)) {
    ros::Time moment;
    moment.fromNSec(static_cast<std::uint64_t>(waiting_.front().light_ns));
    const auto T_world_projector = frames.at(frame, moment);
    const Eigen::Vector3d meant = waiting_.front().p_world;
    waiting_.pop_front();
    if (!T_world_projector) continue;
    const double mm = 1000 * (*T_world_projector * kAhead - meant).norm();
    if (offsets_.size() < kKept) {
      offsets_.push_back(mm);
      continue;
    }
    offsets_[next_] = mm;
    next_ = (next_ + 1) % kKept;
  }
}

std::optional<double> LightOffset::mm() const {
  if (offsets_.empty()) return std::nullopt;
  std::vector<double> sorted = offsets_;
  std::sort(sorted.begin(), sorted.end());
  return sorted[(sorted.size() * 95 + 99) / 100 - 1];
}

}  // namespace afterglow::nodes
