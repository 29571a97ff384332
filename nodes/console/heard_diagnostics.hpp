/// \file
/// /diagnostics in plain words: who is well, and what projector and recorder say of themselves.
#pragma once

#include <diagnostic_msgs/DiagnosticArray.h>
#include <ros/ros.h>

#include <chrono>
#include <cstddef>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>

#include "nodes/tools/diagnostics.hpp"

namespace afterglow::nodes {

/// Any thread.
class HeardDiagnostics {
 public:
  static constexpr std::size_t kMost = 200;  ///< names; further ones are not looked at
  static constexpr std::chrono::seconds kFresh{5}, kKept{60};

  HeardDiagnostics();

  /// [{"name", "level": 0 to 3, "words"}]; level 3: not heard for kFresh.
  nlohmann::ordered_json all() const;
  /// {"words", "layers": [{"topic", "hz", "shown", "words"}]}
  nlohmann::ordered_json projector() const;
  /// {"words", "recording", "dropped", ...}; {}: none is heard.
  nlohmann::ordered_json recorder() const;

 private:
  void hear(const diagnostic_msgs::DiagnosticArray& array);

  mutable std::mutex mutex_;
  HeardStatuses statuses_{kMost};
  ros::NodeHandle node_;
  ros::Subscriber subscriber_;
};

}  // namespace afterglow::nodes
