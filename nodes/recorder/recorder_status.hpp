/// \file
/// The state of the recorder, for /diagnostics.
#pragma once

#include <diagnostic_msgs/DiagnosticStatus.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "replay/record/disk_guard.hpp"
#include "replay/record/recorder.hpp"
#include "replay/store/open/recorder_store.hpp"

namespace afterglow::nodes {

struct RecorderState {
  std::string node;   ///< node without leading slash
  std::string store;  ///< URI of the store
  std::size_t running = 0;
  std::map<std::string, std::uint64_t> named;  ///< RecordingManager::namedCounts()
  replay::RecorderLoad load, load_before;  ///< now, and `seconds` ago
  double seconds = 1;
  std::size_t queue_bytes = 0;  ///< bytes that may wait
  replay::DiskState disk;
  std::optional<std::string> failure;
  std::optional<replay::SendStatus> server;
};

/// ERROR: nothing can be recorded. WARN: messages were dropped since the last time, the queue is
/// half full, the disk is nearly, the server is away or refuses something.
diagnostic_msgs::DiagnosticStatus toDiagnostics(const RecorderState& state);

}  // namespace afterglow::nodes
