/// \file
/// Goals and commands of which one was sent because of the other: /cmd_vel by move_base for its
/// goal, a controller's goal by MoveIt for /execute_trajectory/goal. Of the two, one is played.
/// Source: who publishes and who hears what in move_base, move_group, play_motion,
/// parallel_gripper_fake, pr2_head_action, pr2_gripper_action.
#pragma once

#include <vector>

#include "replay/plan/play_plan.hpp"
#include "replay/record/snapshot.hpp"

namespace afterglow::replay {

/// The lower one was sent by the node that serves the higher goal's action; where nothing was
/// noted, known names tell. The lowest is played, but of an action and the bare command of its own
/// controller the action, whose end is told; and what is named by whoever replays instead of what
/// is not. If both are named, the higher one is refused.
void leaveOutNested(std::vector<PlannedTopic>& topics, const RecordedNodes& nodes);

}  // namespace afterglow::replay
