/// \file
/// Ctrl-C for nodes that have something to finish while ROS still runs: zero the robot's velocity,
/// end a recording. Use with ros::init_options::NoSigintHandler.
#pragma once

namespace afterglow::nodes {

/// From now on SIGINT, SIGTERM and SIGHUP only set a flag; a second one ends the process at once.
void catchStopSignals();
bool isStopRequested();

/// Returns when a stop is requested or ROS is shut down from elsewhere.
void waitForStop();

/// Gives roscpp, which sends in a thread of its own and offers no flush, the time to send what was
/// just published.
void letMessagesLeave();

}  // namespace afterglow::nodes
