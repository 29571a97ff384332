/// \file
/// The begin of guards' programs. C++14 (guard_messages.hpp).
#pragma once

namespace afterglow {
namespace nodes {

/// Prepares a guard before ros::init(): this process goes before those that make the machine busy,
/// where that is permitted, and told to end it stops the robot first (stop_signal.hpp).
void beginGuard();

}  // namespace nodes
}  // namespace afterglow
