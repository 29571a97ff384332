/// \file
/// What would happen if a behavior was replayed: as `afterglow play --dry-run` has it, with the
/// options that player_node has.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "nodes/console/play_wish.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

struct DryRun {
  /// [{"topic", "type", "published", "reason"}]
  nlohmann::ordered_json topics = nlohmann::json::array();
  bool moves = false;
  std::string robot, speed;  ///< for people
  std::string refusal;       ///< why the player would refuse it, and what is amiss else
  std::string unchecked;     ///< what only the replay itself will know
};

/// Listens to the robot for some seconds; moves, advertises and publishes nothing. `store`, which
/// is at `store_uri`: the console's, and it has to be the player's. What is wrong with the behavior, the player's
/// parameters or the store is a refusal. Throws nothing.
DryRun rehearseAs(const std::string& player, const std::string& store_uri,
                  const replay::Store& store, const PlayWish& wish,
                  const std::function<bool()>& is_stopped);

}  // namespace afterglow::nodes
