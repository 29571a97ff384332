/// \file
/// Numbers as a replay's page says them.
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "replay/motion/arm/start_pose.hpp"
#include "replay/play/play_report.hpp"

namespace afterglow::nodes {

inline std::string inSeconds(double seconds) { return fmt::format("{:.2f} s", seconds); }

inline std::string inMilliseconds(std::int64_t ns) {
  return fmt::format("{:.3f}", static_cast<double>(ns) * 1e-6);
}

/// A quantile of lateness in milliseconds; "-" if nothing was sent by a deadline.
inline std::string lateText(const replay::Lateness& lateness, double q) {
  if (lateness.count() == 0) return "-";
  return inMilliseconds(q < 1 ? lateness.quantile(q) : lateness.max());
}

/// Returns how many were to be sent; "-" where other velocities were.
inline std::string plannedText(const replay::PlannedTopic& topic,
                               const replay::TopicReport& played) {
  return played.replaced > 0 ? "-" : std::to_string(topic.count);
}

/// Formats the error of a joint, in mm or degrees, with its sign; `degree` is how that is written
/// there.
inline std::string jointErrorText(bool is_sliding, double error, const std::string& degree) {
  return is_sliding
             ? fmt::format("{:+.1f} mm", error * 1000)
             : fmt::format("{:+.2f}", error * replay::kDegreesPerRadian) + degree;
}

/// "2 sent, 1 succeeded, 1 failed"; empty without goals.
inline std::string goalsText(const replay::GoalBook::Counts& counts) {
  std::vector<std::string> parts;
  for (const auto& [count, word] : {std::pair(counts.sent, " sent"),
                                    {counts.succeeded, " succeeded"},
                                    {counts.failed, " failed"},
                                    {counts.canceled, " canceled"}}) {
    if (count > 0) parts.push_back(std::to_string(count) + word);
  }
  return fmt::format("{}", fmt::join(parts, ", "));
}

}  // namespace afterglow::nodes
