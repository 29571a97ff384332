#include "nodes/recorder/store_space.hpp"

#include <ros/ros.h>

#include <cmath>
#include <optional>

#include "replay/store/retention.hpp"

namespace afterglow::nodes {
namespace {

/// A new behavior may begin ~pre_roll ago; so much earlier nothing is asked for any more.
constexpr std::int64_t kLongBefore_ns = 60'000'000'000;

void pruneOrWarn(replay::Store& store, const replay::RetentionPolicy& policy) {
  try {
    replay::prune(store, policy, [](const replay::Behavior& behavior) {
      ROS_INFO_STREAM("behavior " << behavior.id << " '" << behavior.name << "' made room");
    });
  } catch (const replay::StoreError& error) {
    ROS_WARN_STREAM("making room: " << error.what());
  }
}

}  // namespace

StoreSpace::StoreSpace(const RecorderNodeOptions& options, replay::RecorderStore& store)
    : options_(options), store_(store), folder_(store.local().folder()) {}

replay::DiskState StoreSpace::disk() const {
  const auto min_space = static_cast<std::uint64_t>(options_.min_space_megabytes) << 20;
  const std::optional<std::uint64_t> free =
      folder_.empty() ? std::nullopt : replay::freeBytes(folder_);
  if (!free) return {};
  replay::DiskState state = replay::judgeDisk(folder_, *free, min_space);
  if (!state.text.empty()) state.text += "; " + options_.space_advice;
  return state;
}

void StoreSpace::makeRoom() {
  const auto now_ns = static_cast<std::int64_t>(ros::Time::now().toNSec());
  try {
    store_.removeSent({now_ns - std::llround(options_.pre_roll_s * 1e9) - kLongBefore_ns});
  } catch (const replay::StoreError& error) {
    ROS_WARN_STREAM("making room: " << error.what());
  }
  if (options_.retention_days <= 0 && options_.retention_gigabytes <= 0) {
    return;
  }
  replay::RetentionPolicy policy;
  policy.keep_tags = options_.keep_tags;
  if (options_.retention_days > 0) {
    policy.ended_before = {now_ns - std::llround(options_.retention_days * 86400e9)};
  }
  if (options_.retention_gigabytes > 0) {
    policy.most_bytes = static_cast<std::uint64_t>(options_.retention_gigabytes * 1e9);
  }
  store_.tend([policy](replay::Store& store) { pruneOrWarn(store, policy); });
}

}  // namespace afterglow::nodes
