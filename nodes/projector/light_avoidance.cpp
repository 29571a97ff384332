#include "nodes/projector/light_avoidance.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <variant>

namespace afterglow::nodes {
namespace {

/// Begins a problem of the projector itself, which keeps it dark.
const std::string kProblem = "projector: avoid: ";
const std::string kWayOut =
    "; nothing is lit, as nobody can tell what it would hit. Without it: take it out of 'avoid'";

constexpr std::size_t kAvoidedQueue = 10;  // messages that wait for their transform
constexpr std::size_t kMostColumns = 100'000;
/// A column's points, meters apart: a share of their padding, so that there are no gaps.
constexpr double kColumnShare = 1. / 3, kLeastColumnStep = 0.02;

std::int64_t nanoseconds(ros::Time time) { return static_cast<std::int64_t>(time.toNSec()); }

bool haveStayed(const std::vector<render::SurfacePatch>& a,
                const std::vector<render::SurfacePatch>& b) {
  const auto same = [](const render::SurfacePatch& x, const render::SurfacePatch& y) {
    return x.T_world_surface.matrix().matrix() == y.T_world_surface.matrix().matrix() &&
           x.polygon == y.polygon && x.relief == y.relief;
  };
  return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(), same);
}

std::string ageWords(std::int64_t ns) { return fmt::format("{:.1f} s old", 1e-9 * double(ns)); }

}  // namespace

LightAvoidance::LightAvoidance(const AvoidConfig& config, const tf2::BufferCore& buffer,
                               const std::string& fixed_frame)
    : config_(config), buffer_(buffer), frames_(buffer, fixed_frame) {
  LayerState::Limits limits;
  limits.waiting = kAvoidedQueue;
  for (const AvoidSource& source : config_.sources) {
    render::AvoidedPoints standing;
    standing.padding = static_cast<float>(source.padding);
    sources_.push_back(
        {{source.layer.topic, 1, limits}, "", std::nullopt, standing, source.column});
  }
}

// ------------------------------------------------------------------------------------------ input

std::string LightAvoidance::faultOf(const Source& source, const std_msgs::Header& header,
                                    const Converted<Content>& content, ros::Time now) const {
  if (!content.value) return content.reason;
  if (content.value->drawables.empty()) return "it sees nothing at all";
  const auto& cloud = std::get<render::PointCloud>(content.value->drawables[0].shape);
  if (source.column > 0 && cloud.points.size() > kMostColumns) {
    return "it has more ranges than any range finder";
  }
  const std::string fault = headerFault(header);
  if (!fault.empty()) return fault;
  if (header.stamp.isZero()) return "without a stamp, nobody can tell how old it is";
  const bool is_ahead = nanoseconds(header.stamp) > nanoseconds(now) + config_.patience_ns;
  return is_ahead ? "stamped ahead of its arrival: set its sender's clock (chrony, ntp)" : "";
}

void LightAvoidance::take(Source& source, const std_msgs::Header& header,
                          Converted<Content> content, ros::Time now) {
  source.state.beginMessage();
  source.last_fault = faultOf(source, header, content, now);
  if (!source.last_fault.empty()) return source.state.drop(source.last_fault);
  if (!content.reason.empty()) source.state.remark(content.reason);
  content.value->frame = frameName(header.frame_id);
  content.value->stamp = header.stamp;
  frames_.forget(nanoseconds(now));
  source.state.put({"", 0}, std::move(*content.value), nanoseconds(now), frames_);
}

void LightAvoidance::update(ros::Time now, const std::vector<render::SurfacePatch>& surfaces) {
  now_ns_ = nanoseconds(now);
  frames_.forget(now_ns_);
  for (auto& [frame, frames] : seen_from_) frames.forget(now_ns_);
  const bool have_surfaces_changed = !haveStayed(surfaces_, surfaces);
  surfaces_ = surfaces;
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    sources_[i].state.update(now_ns_, frames_);
    place(i, have_surfaces_changed);
  }
}

void LightAvoidance::place(std::size_t index, bool have_surfaces_changed) {
  Source& source = sources_[index];
  const std::optional<ros::Time> stamp = source.state.stampShown();
  if (stamp == source.seen_at && !have_surfaces_changed) return;
  source.seen_at = stamp;
  if (!stamp) return;
  const std::vector<render::Drawable> seen = source.state.drawables(frames_);
  const auto& cloud = std::get<render::PointCloud>(seen.at(0).shape);
  const AvoidSource& config = config_.sources[index];
  source.standing.pose = seen[0].pose;
  source.standing.points =
      render::standingPoints(cloud.points, seen[0].pose, surfaces_, config_.height);
  source.standing.points =
      render::foreignPoints(source.standing.points, seen[0].pose, linksAt(*stamp));
  if (source.column <= 0) return;
  source.standing.points =
      render::standingColumns(source.standing.points, seen[0].pose, surfaces_, source.column,
                              std::max(kColumnShare * config.padding, kLeastColumnStep));
  source.standing.pose = {};
}

std::vector<render::AvoidedPoints> LightAvoidance::linksAt(ros::Time stamp) {
  std::vector<render::AvoidedPoints> links;
  if (!robot_) return links;
  for (const RobotSurface::Part& part : robot_->parts()) {
    const auto T_fixed_part = frames_.at(part.frame, stamp);
    if (!T_fixed_part) continue;
    links.push_back({Rigid<World, World>(*T_fixed_part), part.points,
                     static_cast<float>(config_.robot->padding)});
  }
  return links;
}

void LightAvoidance::clear() {
  for (Source& source : sources_) {
    source.state.removeAll();
    source.seen_at.reset();
  }
}

// ----------------------------------------------------------------------------------------- output

/// Empty: its points can be used.
std::string LightAvoidance::problemOf(Source& source) {
  const LayerStatus status = source.state.status();
  const std::string of = kProblem + status.topic;
  if (source.seen_at && !isOld(nanoseconds(*source.seen_at))) return "";
  if (!source.last_fault.empty()) return of + ": " + source.last_fault + kWayOut;
  const std::string& missing = source.state.explain(frames_);
  if (!missing.empty()) return of + ": " + missing + kWayOut;
  if (!source.seen_at) return of + ": no message yet" + kWayOut;
  return of + " is stale: what it saw is " + ageWords(now_ns_ - nanoseconds(*source.seen_at)) +
         kWayOut;
}

std::optional<std::vector<render::AvoidedPoints>> LightAvoidance::points(
    const std::string& projector_frame, const Rigid<Projector, World>& T_projector_world,
    std::int64_t light_ns, std::vector<std::string>& problems) {
  std::vector<render::AvoidedPoints> all;
  std::string problem;
  if (!sources_.empty() && surfaces_.empty()) {
    problem = kProblem + "no surface is known, and so nothing of what stands on one" + kWayOut;
  }
  for (Source& source : sources_) {
    if (problem.empty()) problem = problemOf(source);
    if (!problem.empty()) break;
    const double ahead_s = 1e-9 * static_cast<double>(light_ns - nanoseconds(*source.seen_at));
    all.push_back(source.standing);
    all.back().padding += static_cast<float>(config_.speed * std::max(ahead_s, 0.));
  }
  if (problem.empty() && config_.robot) {
    problem = addLinks(projector_frame, T_projector_world.inverse(), light_ns, all);
  }
  if (problem.empty()) return all;
  problems.push_back(problem);
  return std::nullopt;
}

/// Returns why they cannot be told; empty: they are added.
std::string LightAvoidance::addLinks(const std::string& projector_frame,
                                     const Rigid<World, Projector>& T_world_projector,
                                     std::int64_t light_ns,
                                     std::vector<render::AvoidedPoints>& points) {
  if (!robot_) return kProblem + robot_problem_ + kWayOut;
  FrameLookup& frames =
      seen_from_.try_emplace(projector_frame, buffer_, projector_frame).first->second;
  const std::optional<std::size_t> housing = robot_->partOf(projector_frame, buffer_);
  for (std::size_t i = 0; i < robot_->parts().size(); ++i) {
    if (i == housing) continue;
    const RobotSurface::Part& part = robot_->parts()[i];
    const auto newest = frames.newest(part.frame);
    if (!newest) return frames.noTransform(kProblem + "the robot", part.frame) + kWayOut;
    const auto T_projector_part =
        newest->stamp_ns != 0 && isOld(newest->stamp_ns)
            ? std::nullopt
            : frames.predicted(part.frame, *newest, light_ns, projector_frame);
    if (!T_projector_part) {
      return kProblem + "the transform from '" + printable(part.frame) + "' to '" +
             printable(projector_frame) + "' is stale: " + ageWords(now_ns_ - newest->stamp_ns) +
             kWayOut;
    }
    points.push_back({Rigid<World, World>(T_world_projector.matrix() * *T_projector_part),
                      part.points, static_cast<float>(config_.robot->padding)});
  }
  return "";
}

bool LightAvoidance::isWaiting() const {
  return std::any_of(sources_.begin(), sources_.end(),
                     [](const Source& source) { return source.state.isWaiting(); });
}

std::vector<LayerStatus> LightAvoidance::status() const {
  std::vector<LayerStatus> all;
  for (const Source& source : sources_) all.push_back(source.state.status());
  return all;
}

}  // namespace afterglow::nodes
