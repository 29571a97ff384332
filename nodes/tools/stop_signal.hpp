/// \file
/// Requests to end, for nodes that have something to finish while ROS still runs: zero the robot's
/// velocity, end a recording. Use with ros::init_options::NoSigintHandler. C++14, as
/// afterglow_guard is built on robots with old systems, too. stop_signal.cpp knows no ROS, for
/// verbs that need none; shutdown_request.cpp has the rest.
#pragma once

#include <string>

namespace afterglow {
namespace nodes {

enum class SecondSignal { EndsAtOnce, IsIgnored };

/// Makes SIGINT, SIGTERM and SIGHUP only set a flag from now on. The same signal again, more than
/// 100 ms after the first, ends the process at once, or is ignored.
void catchStopSignals(SecondSignal second = SecondSignal::EndsAtOnce);
/// Makes a shutdown request of the ROS graph (rosnode kill, another node of the same name) set the
/// flag from now on, too. roscpp itself would shut the publishers down before a last message can be
/// sent. Call it before ros::start(), which the first ros::NodeHandle does.
void catchShutdownRequests();

/// Sets the flag as a shutdown request does.
void noteShutdownRequest();

bool isStopRequested();
/// The cause of the stop: "a signal" or "a shutdown request"; empty without one.
std::string stopRequest();
/// Forgets a request that was obeyed: the next one counts anew.
void forgetStopRequest();
/// A descriptor for poll(), readable once a stop is requested; -1 if no signals are caught.
int stopRequestFd();

/// Returns when a stop is requested or ROS is shut down from elsewhere.
void waitForStop();

/// Gives roscpp, which sends in a thread of its own and offers no flush, the time to send what was
/// just published.
void letMessagesLeave();

}  // namespace nodes
}  // namespace afterglow
