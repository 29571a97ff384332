#include "nodes/fetch/head_pointer.hpp"

#include <algorithm>
#include <cmath>

namespace afterglow::nodes {

void HeadPointer::start(const Turn& turn, const JointStates& measured, Nanoseconds now) {
  JointKnot begin = spliceKnot().value_or(here(measured, now));
  double needed = seconds(turn.min_duration);
  for (std::size_t i = 0; i < joints().size(); ++i) {
    const double limit = joints()[i].max_velocity;
    const double speed = turn.max_velocity > 0 ? std::min(turn.max_velocity, limit) : limit;
    needed = std::max(needed, std::abs(turn.angles[i] - begin.positions[i]) / speed);
  }
  JointKnot end;
  end.time = begin.time + Nanoseconds(std::llround(needed * 1e9));
  end.positions = turn.angles;
  end.velocities = end.accelerations = std::vector<double>(joints().size(), 0.0);
  take(JointPath({std::move(begin), std::move(end)}, joints()));
}

void HeadPointer::judge(const JointStates&, Nanoseconds now) {
  if (now > path().end()) succeed();
}

}  // namespace afterglow::nodes
