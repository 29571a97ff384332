/// \file
/// Requests to end, for nodes that have something to finish while ROS still runs: zero the robot's
/// velocity, end a recording. Use with ros::init_options::NoSigintHandler.
#pragma once

#include <string>

namespace afterglow::nodes {

enum class SecondSignal { EndsAtOnce, IsIgnored };

/// From now on SIGINT, SIGTERM and SIGHUP only set a flag; a second one ends the process at once,
/// unless that is not wanted.
void catchStopSignals(SecondSignal second = SecondSignal::EndsAtOnce);
/// From now on a shutdown that is asked for over the graph (rosnode kill, another node of the same
/// name) sets the flag, too. roscpp itself would take the publishers away before anybody could send
/// a last word. Call it before ros::start(), which the first ros::NodeHandle does.
void catchShutdownRequests();

bool isStopRequested();
/// Who wanted it: "a signal" or "a shutdown request"; empty: nobody.
std::string stopRequest();
/// Readable once a stop is requested, for who waits in poll(). -1: nothing is caught.
int stopRequestFd();

/// Returns when a stop is requested or ROS is shut down from elsewhere.
void waitForStop();

/// Gives roscpp, which sends in a thread of its own and offers no flush, the time to send what was
/// just published.
void letMessagesLeave();

}  // namespace afterglow::nodes
