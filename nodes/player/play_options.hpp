/// \file
/// The one table of what a replay can be asked for. The command line of `afterglow play`, the
/// parameters of player_node and the options of its goals are made of it: an option is
/// --goal-wait 5 on the command line, ~goal_wait as a parameter and "goal_wait=5" in a goal. What
/// is not given stays as it is in the request. Needs no ROS master.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "nodes/player/replay_request.hpp"

namespace afterglow::nodes {

/// The groups of options as --help lists them. A goal may give all but what is the robot's: that is
/// its owner's, by parameters or on the command line.
enum class PlayGroup { What, Part, How, InStep, Listeners, Time, Names, Robot };
const char* titleOf(PlayGroup group);

/// The texts of one option, as they were given: one, those of a list; of a flag "true" or "false".
using OptionTexts = std::vector<std::string>;

struct PlayOption {
  enum class Kind { Flag, Value, List };

  PlayGroup group = PlayGroup::What;
  Kind kind = Kind::Flag;
  std::string name;     ///< "goal_wait"
  std::string aliases;  ///< further names on the command line, with commas: "-r", "--clock"
  std::string value;    ///< noun for people: "SECONDS"; empty: a flag
  std::string alone;    ///< value if none is written; empty: it needs one
  std::string otherwise;  ///< default for people; a flag's: "true", or empty
  std::string help;
  std::string needs, excludes;    ///< names of others
  std::vector<std::string> keys;  ///< keys of a list of KEY=VALUE: parameters ~NAME/KEY
  /// Returns why a text is no value of it; empty: it is one.
  std::function<std::string(const std::string&)> complaint;
  std::function<void(ReplayRequest&, const OptionTexts&)> set;
};

/// Returns the options in the order in which they are to be set.
const std::vector<PlayOption>& playOptions();

/// A name that an option had once, its name now, and what else is different.
struct FormerOption {
  const char* name;
  const char* now;
  const char* remark;
};
const std::vector<FormerOption>& formerOptions();

/// Sets what was given for an option; a list may also be written as one text, with commas. Throws
/// std::invalid_argument, "rate: 0 is no number of 0.001 to 1000", and std::runtime_error, one
/// line, for a file that is not understood.
void giveOption(ReplayRequest& request, const PlayOption& option, const OptionTexts& texts);
/// Returns why giveOption() would not take a text; empty: it would.
std::string complaintOf(const PlayOption& option, const std::string& text);

/// Sets the options of a goal: "rate=0.5", "pause", "also=/a,/b". Throws as giveOption(), and
/// std::invalid_argument for names that are none, or not for goals.
void giveGoalOptions(ReplayRequest& request, const std::vector<std::string>& options);

}  // namespace afterglow::nodes
