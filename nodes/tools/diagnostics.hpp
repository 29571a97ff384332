/// \file
/// Statuses of /diagnostics: how they are written, and how they are read.
#pragma once

#include <diagnostic_msgs/DiagnosticStatus.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>

namespace afterglow::nodes {

/// The hardware of a bridge to ROS 2.
inline constexpr const char* kBridgeHardware = "ros2_bridge";

void addValue(diagnostic_msgs::DiagnosticStatus& status, const std::string& key,
              const std::string& value);

/// A status as it was heard.
struct HeardStatus {
  HeardStatus() = default;
  explicit HeardStatus(const diagnostic_msgs::DiagnosticStatus& status);

  std::string name;      ///< "projector_node: /cloud"
  std::string hardware;  ///< name of Afterglow's own: "projector", "recorder"
  int level = 0;         ///< level of diagnostic_msgs/DiagnosticStatus
  std::string message;
  std::map<std::string, std::string> values;
  std::int64_t at_ns = 0;  ///< time when it was heard, in steady time
  /// Messages that a layer received a second, since the status before; below 0: unknown.
  double received_hz = -1;

  std::string value(const std::string& key) const;  ///< empty without one
  double number(const std::string& key) const;      ///< 0 without one
};

/// The newest status of each name. One thread at a time.
class HeardStatuses {
 public:
  /// Names beyond the first `most` are not looked at.
  explicit HeardStatuses(std::size_t most) : most_(most) {}

  /// Returns the status, null where there are too many names.
  const HeardStatus* take(const diagnostic_msgs::DiagnosticStatus& status, std::int64_t now_ns);
  void forgetBefore(std::int64_t time_ns);
  const std::map<std::string, HeardStatus>& all() const { return heard_; }  ///< statuses by name

 private:
  const std::size_t most_;
  std::map<std::string, HeardStatus> heard_;
};

}  // namespace afterglow::nodes
