/// \file
/// What is left of a goal that was interrupted, to go on after a pause.
#pragma once

#include <cstdint>

#include "replay/messages/message.hpp"

namespace afterglow::replay {

/// A joint trajectory goal loses the points that had passed `elapsed_ns` after it was sent; the
/// rest comes as much earlier. If all had passed, the last point stays, to be reached shortly.
/// Every other goal (gripper, point head) holds a target and is returned as it was.
Bytes remainderOfGoal(const Channel& channel, const Bytes& goal, std::int64_t elapsed_ns);

}  // namespace afterglow::replay
