/// \file
/// Keeps space on the disk for the behaviors that are still to be recorded.
#pragma once

#include <string>

#include "nodes/recorder/recorder_options.hpp"
#include "replay/record/disk_guard.hpp"
#include "replay/store/open/recorder_store.hpp"

namespace afterglow::nodes {

/// Any thread. Options and store must outlive it.
class StoreSpace {
 public:
  StoreSpace(const RecorderNodeOptions& options, replay::RecorderStore& store);

  /// Judged by ~min_space; Ample if the system does not say.
  replay::DiskState disk() const;
  /// Removes old behaviors as ~retention_days and ~retention_gigabytes say, on a server too, and
  /// from this machine what a server has. To be called now and then; warns of what fails.
  void makeRoom();

 private:
  const RecorderNodeOptions& options_;
  replay::RecorderStore& store_;
  const std::string folder_;  ///< folder in which the recorder's file grows
};

}  // namespace afterglow::nodes
