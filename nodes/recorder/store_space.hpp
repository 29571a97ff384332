/// \file
/// Keeps space on the disk for the behaviors that are still to be recorded.
#pragma once

#include <string>

#include "nodes/recorder/recorder_options.hpp"
#include "replay/record/disk_guard.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

/// Any thread. Options and store must outlive it.
class StoreSpace {
 public:
  StoreSpace(const RecorderNodeOptions& options, replay::Store& store);

  /// Judged by ~min_space; Ample if the system does not say.
  replay::DiskState disk() const;
  /// Removes old behaviors as ~retention_days and ~retention_gigabytes say. To be called now and
  /// then; throws StoreError.
  void makeRoom();

 private:
  const RecorderNodeOptions& options_;
  replay::Store& store_;
  const std::string folder_;  ///< the store's; empty if the store is not on this machine
};

}  // namespace afterglow::nodes
