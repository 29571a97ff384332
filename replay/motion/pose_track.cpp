#include "replay/motion/pose_track.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace afterglow::replay {
namespace {

constexpr std::int64_t kHalfWindow = 50'000'000;  // ns on either side of a velocity
constexpr double kAlmostAround = 2.8;  // rad; from farther off the shorter way back is another one

}  // namespace

PoseTrack::PoseTrack(std::vector<Sample> samples, std::string frame, bool is_localized)
    : samples_(std::move(samples)), frame_(std::move(frame)), is_localized_(is_localized) {
  if (samples_.empty()) throw std::invalid_argument("a pose track needs a pose");
  for (std::size_t i = 1; i < samples_.size(); ++i) {
    if (samples_[i].stamp <= samples_[i - 1].stamp) {
      throw std::invalid_argument("the stamps of a pose track must rise");
    }
    length_ += distance(samples_[i - 1].pose, samples_[i].pose);
  }
}

PlanarPose PoseTrack::at(Stamp stamp) const {
  const auto after =
      std::upper_bound(samples_.begin(), samples_.end(), stamp,
                       [](Stamp wanted, const Sample& sample) { return wanted < sample.stamp; });
  if (after == samples_.begin()) return startPose();
  if (after == samples_.end()) return endPose();
  const Sample& a = *(after - 1);
  const double part = static_cast<double>(stamp.ns - a.stamp.ns) /
                      static_cast<double>(after->stamp.ns - a.stamp.ns);
  return {a.pose.x + part * (after->pose.x - a.pose.x),
          a.pose.y + part * (after->pose.y - a.pose.y),
          wrapAngle(a.pose.yaw + part * wrapAngle(after->pose.yaw - a.pose.yaw))};
}

PoseTrack PoseTrack::part(Stamp from, Stamp to) const {
  from = std::clamp(from, begin(), end());
  to = std::clamp(to, from, end());
  std::vector<Sample> samples{{from, at(from)}};
  for (const Sample& sample : samples_) {
    if (sample.stamp > from && sample.stamp < to) samples.push_back(sample);
  }
  if (to > from) samples.push_back({to, at(to)});
  PoseTrack track(std::move(samples), frame_, is_localized_);
  track.begin_error = begin_error;
  track.end_error = end_error;
  track.measured_error = measured_error;
  return track;
}

PlanarVelocity PoseTrack::velocityAt(Stamp stamp) const {
  if (stamp < begin() || stamp >= end()) return {};
  const Stamp from{std::max(stamp.ns - kHalfWindow, begin().ns)};
  const Stamp to{std::min(stamp.ns + kHalfWindow, end().ns)};
  const double seconds = secondsBetween(from, to);
  const PlanarPose step = between(at(from), at(to));
  // The chord of an arc points half its turn to the side.
  const double c = std::cos(step.yaw / 2), s = std::sin(step.yaw / 2);
  return {(c * step.x + s * step.y) / seconds, step.yaw / seconds,
          (c * step.y - s * step.x) / seconds};
}

HeadingRange PoseTrack::headingsAtEnd(double radius) const {
  HeadingRange range;
  double turned = 0;
  for (std::size_t i = samples_.size() - 1; i-- > 0;) {
    const PlanarPose& pose = samples_[i].pose;
    if (distance(pose, endPose()) > radius) break;
    turned += wrapAngle(pose.yaw - samples_[i + 1].pose.yaw);
    range = {std::min(range.from, turned), std::max(range.to, turned)};
  }
  return {std::max(range.from, -kAlmostAround), std::min(range.to, kAlmostAround)};
}

std::string whyIncomplete(const PoseTrack& track, Stamp first, Stamp last) {
  constexpr double kUnseen = 0.5, kUnseenWay = 0.1, kUnseenTurn = 0.25;  // s, m, rad
  if (const double late = secondsBetween(first, track.begin()); late > kUnseen) {
    return fmt::format("its poses were recorded only {:.1f} s after its first velocity", late);
  }
  if (const double early = secondsBetween(track.end(), last); early > kUnseen) {
    return fmt::format("its poses end {:.1f} s before its last velocity", early);
  }
  for (const TrackSpan& gap : track.gaps) {
    if (gap.to < first || gap.from > last) continue;
    const PlanarPose from = track.at(gap.from), to = track.at(gap.to);
    const double turn = std::abs(wrapAngle(to.yaw - from.yaw));
    if (distance(from, to) <= kUnseenWay && turn <= kUnseenTurn) continue;
    return fmt::format(
        "no pose was recorded for {:.1f} s in which it went {:.2f} m and turned {:.0f} deg",
        secondsBetween(gap.from, gap.to), distance(from, to), turn * kDegreesPerRadian);
  }
  return "";
}

}  // namespace afterglow::replay
