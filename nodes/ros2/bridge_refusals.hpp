/// \file
/// What a bridge does not carry, and why.
#pragma once

#include <ros/console.h>

#include <cstdint>
#include <map>
#include <mutex>
#include <string>

namespace afterglow::nodes {

/// Any thread.
class BridgeRefusals {
 public:
  /// Says it once as long as it stays the same.
  void tell(const std::string& topic, const std::string& why) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (whys_[topic] == why) return;
    whys_[topic] = why;
    ROS_WARN_STREAM(topic << " is not carried: " << why);
  }
  /// A message of the topic that is none of its type.
  void tellBadMessage(const std::string& topic, const std::string& why) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (bad_[topic]++ == 0) ROS_WARN_STREAM(topic << ": a message is left out: " << why);
  }
  void forget(const std::string& topic) {
    const std::lock_guard<std::mutex> lock(mutex_);
    whys_.erase(topic);
  }
  std::map<std::string, std::string> whys() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return whys_;
  }
  std::map<std::string, std::uint64_t> badMessages() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return bad_;
  }

 private:
  mutable std::mutex mutex_;
  std::map<std::string, std::string> whys_;   ///< by topic
  std::map<std::string, std::uint64_t> bad_;  ///< counts by topic
};

}  // namespace afterglow::nodes
