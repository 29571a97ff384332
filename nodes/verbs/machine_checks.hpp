/// \file
/// `afterglow doctor`: what this machine has, without ROS. Each check that asks drivers, displays,
/// servers or other programs does it in a process of its own and for a bounded time; all are to be
/// called while this process has one thread. None throws.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "nodes/verbs/checkup.hpp"
#include "render/gl/monitor_choice.hpp"

namespace afterglow::nodes {

Checkup checkGpu();
/// Of the description that GlContext gives; a software renderer is named as such.
Checkup judgeRenderer(const std::string& description);

/// What a projector's picture needs of the monitors.
struct WantedMonitor {
  std::string projector;        ///< its name among several; else empty
  std::string monitor;          ///< as chooseMonitor() takes it
  int width = 0, height = 0;    ///< px
};
/// What the configuration wants; why it cannot be read becomes the finding "configuration".
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
/// Whether this machine's clock is set by a time server, as the kernel says.
Checkup checkOwnClock();
/// How far the clock of the master's host is from this one's, asked of its time server.
Checkup checkRobotClock(const std::string& host);
Checkup checkSound();
Checkup checkStore(const std::string& uri);
Checkup checkDisk(const std::string& uri);

}  // namespace afterglow::nodes
