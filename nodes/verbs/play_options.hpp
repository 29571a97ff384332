/// \file
/// The command line of `afterglow play`: what rosbag play and ros2 bag play have, under their
/// names.
#pragma once

#include <CLI/App.hpp>
#include <string>
#include <vector>

#include "nodes/player/replay_session.hpp"

namespace afterglow::nodes {

struct PlayCommand {
  std::string store, report_file;
  std::vector<std::string> behaviors;  ///< the words of one, or several ids
  ReplayRequest request;
  bool is_dry_run = false, is_json = false, is_quiet = false, has_keys = true;

  // As they are written.
  std::string rename_space, prefix, rules_file, limits_file, unheard;
  std::vector<std::string> remap, remap_frame, pause_topics, anchors, latency, on_failure;
  bool is_sim = false, follows_clock = false, keeps_light = false, is_normal = false;
  double duration_s = 0, until_s = 0, skip_empty_s = 0;
};

void addPlayOptions(CLI::App& verb, PlayCommand& command);

/// What was written becomes the request. Throws std::runtime_error, one line.
void readPlayOptions(PlayCommand& command);

}  // namespace afterglow::nodes
