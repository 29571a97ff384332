#include <chrono>
#include <cmath>

#include "nodes/recorder/recording_desk.hpp"
#include "replay/store/retention.hpp"

namespace afterglow::nodes {

replay::DiskState RecordingDesk::disk() const {
  const auto min_space = static_cast<std::uint64_t>(options_.min_space_megabytes) << 20;
  const std::optional<std::uint64_t> free =
      folder_.empty() ? std::nullopt : replay::freeBytes(folder_);
  return free ? replay::judgeDisk(folder_, *free, min_space) : replay::DiskState{};
}

void RecordingDesk::lookAtClocks() {
  const auto steady = std::chrono::steady_clock::now().time_since_epoch();
  recorder_.look({rosNow(), wallNow(),
                  std::chrono::duration_cast<std::chrono::nanoseconds>(steady).count(),
                  !ros::Time::isSystemTime()});
}

void RecordingDesk::watch() {
  for (const std::string& text : recorder_.takeNotices()) {
    ROS_WARN_STREAM(text);
  }
  tellDrops();
  const replay::DiskState state = disk();
  std::optional<std::string> problem = recorder_.failure();
  if (!problem && state.level == replay::DiskState::Level::Full) {
    problem = state.text;
  }
  if (state.level == replay::DiskState::Level::Low) {
    ROS_WARN_STREAM_THROTTLE(60, state.text);
  }
  if (!problem) {
    return;
  }
  for (const std::int64_t id : runningIds()) {
    ROS_ERROR_STREAM("behavior " << id << " is cut short: " << *problem);
  }
  interruptAll(*problem);
}

void RecordingDesk::tellDrops() {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (auto& [id, running] : running_) {
    const std::uint64_t dropped = recorder_.counts(id).dropped;
    if (dropped > running.dropped_told) {
      ROS_WARN_STREAM("behavior " << id << ": " << dropped - running.dropped_told
                                  << " messages were dropped, " << dropped << " in all");
      running.dropped_told = dropped;
    }
  }
}

void RecordingDesk::prune() {
  if (options_.retention_days <= 0 && options_.retention_gigabytes <= 0) {
    return;
  }
  replay::RetentionPolicy policy;
  policy.keep_tags = options_.keep_tags;
  if (options_.retention_days > 0) {
    policy.ended_before = {rosNow().ns - std::llround(options_.retention_days * 86400e9)};
  }
  if (options_.retention_gigabytes > 0) {
    policy.most_bytes = static_cast<std::uint64_t>(options_.retention_gigabytes * 1e9);
  }
  replay::prune(*store_, policy, [](const replay::Behavior& behavior) {
    ROS_INFO_STREAM("behavior " << behavior.id << " '" << behavior.name << "' made room");
  });
}

std::optional<replay::SpoolStatus> RecordingDesk::spool() const {
  const auto* source = dynamic_cast<const replay::SpoolStatusSource*>(store_.get());
  return source ? std::optional<replay::SpoolStatus>(source->spoolStatus()) : std::nullopt;
}

}  // namespace afterglow::nodes
