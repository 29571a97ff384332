/// \file
/// `afterglow doctor`: what this machine has, without ROS. Each check that asks drivers, displays,
/// servers or other programs does it in a process of its own and for a bounded time; all are to be
/// called while this process has one thread. None throws.
/// The difference between another machine's clock and this one's, asked of its time server (NTP:
/// chrony, ntpd, systemd-timesyncd does not answer) by one question. Source: RFC 4330 (SNTP),
/// sections 4 and 5.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "nodes/verbs/robot_checks.hpp"
#include "render/gl/monitor_choice.hpp"

namespace afterglow::nodes {

/// The distance between another machine's clock and this one's.
struct ClockOffset {
  std::int64_t ahead_ns = 0;    ///< the other clock is ahead of ours by so much
  std::int64_t at_most_ns = 0;  ///< and that is wrong by no more: half of the round trip
};

/// The best of up to 4 questions. Empty if no time server answers there within `seconds`, or it
/// says that its clock is not set.
std::optional<ClockOffset> askTimeServer(const std::string& host, double seconds,
                                         std::uint16_t port = 123);

/// Returns true if an address of that host is this machine's; false if the name is not known.
bool isThisMachine(const std::string& host);

Checkup checkGpu();
/// Judges the description that GlContext gives; a software renderer is named as such.
Checkup judgeRenderer(const std::string& description);

/// The needs of a projector's picture from the monitors.
struct WantedMonitor {
  std::string projector;        ///< name of the projector among several; else empty
  std::string monitor;          ///< monitor as chooseMonitor() takes it
  int width = 0, height = 0;    ///< px
};
/// The wishes of the configuration; why it cannot be read becomes the finding "configuration".
struct ConfigurationCheck {
  Checkup finding;
  std::vector<WantedMonitor> wanted;
};
ConfigurationCheck checkConfiguration(const std::string& config, const std::string& calibration);
Checkup checkMonitors(const std::vector<WantedMonitor>& wanted);
Checkup judgeMonitors(const std::vector<render::Monitor>& monitors,
                      const std::vector<WantedMonitor>& wanted);

/// SCHED_FIFO, which keeps a replay on time.
Checkup checkRealtime();
/// Checks whether this machine's clock is set by a time server, as the kernel says.
Checkup checkOwnClock();
/// Checks how far the clock of the master's host is from this one's, asked of its time server.
Checkup checkRobotClock(const std::string& host);
Checkup checkSound();
Checkup checkStore(const std::string& uri);
Checkup checkDisk(const std::string& uri);

}  // namespace afterglow::nodes
