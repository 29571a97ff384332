/// \file
/// What a bridge does not carry, and why; messages that it carried, and those that it could not.
#pragma once

#include <ros/console.h>

#include <cstdint>
#include <map>
#include <mutex>
#include <string>

namespace afterglow::nodes {

/// Messages of a topic, one way.
struct CarriedCount {
  std::uint64_t heard = 0, handed_on = 0;
  std::uint64_t lost = 0;      ///< before they came: a writer of ROS 2 gave them up
  std::uint64_t given_up = 0;  ///< by the bridge, as somebody who hears the topic is too slow

  bool isWhole() const { return lost + given_up == 0; }
  /// "5 heard, 5 handed on"
  std::string text() const {
    std::string text = std::to_string(heard) + " heard, " + std::to_string(handed_on) + " handed on";
    if (lost > 0) text += ", " + std::to_string(lost) + " lost before";
    if (given_up > 0) text += ", " + std::to_string(given_up) + " given up for a slow subscriber";
    return text;
  }
};

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
