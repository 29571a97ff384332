/// \file
/// The command line of `afterglow play`: the options of nodes/player/play_options.hpp, and those of
/// the command itself.
#pragma once

#include <CLI/App.hpp>
#include <map>
#include <string>
#include <vector>

#include "nodes/player/play_options.hpp"

namespace afterglow::nodes {

struct PlayCommand {
  std::string store, report_file;
  std::vector<std::string> behaviors;  ///< the words of one, or several ids
  bool is_dry_run = false, is_json = false, is_quiet = false, has_no_keys = false;
  std::map<const PlayOption*, OptionTexts> given;

  /// Returns the request that was given. Throws std::runtime_error and std::invalid_argument, one
  /// line.
  ReplayRequest request() const;
};

/// `command` has to live until the command line is read.
void addPlayOptions(CLI::App& verb, PlayCommand& command);

}  // namespace afterglow::nodes
