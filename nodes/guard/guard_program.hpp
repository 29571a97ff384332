/// \file
/// The common part of guards' programs. C++14 (guard_messages.hpp).
#pragma once

#include <sched.h>

#include <functional>
#include <string>

namespace afterglow {
namespace nodes {

/// This process goes before those that make the machine busy, where that is permitted: its threads
/// from now on, too. They take turns: Fast DDS 2.9 has a thread that spins until another has run.
/// `priority`: 1 to 99.
inline void goFirst(int priority) {
  sched_param parameters = {};
  parameters.sched_priority = priority;
  sched_setscheduler(0, SCHED_RR, &parameters);
}

/// Prepares a guard before ros::init(): it goes first, and told to end it stops the robot first
/// (stop_signal.hpp).
void beginGuard();

struct GuardText {
  std::string name;    ///< of the program and its node
  std::string does;    ///< "stops this robot when a player is gone."
  std::string launch;  ///< its launch file
};

/// The main() of a guard that is a node of its own: answers --help, else waits for a master and
/// calls `guard`, which returns when it was told to end. Returns the exit status: 0, or 1 with one
/// line on stderr for an exception.
int runGuard(int argc, char** argv, const GuardText& text, const std::function<void()>& guard);

}  // namespace nodes
}  // namespace afterglow
