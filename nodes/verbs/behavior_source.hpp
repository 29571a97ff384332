/// \file
/// A behavior that a verb is given by words or as a bag, and the store it lies in.
#pragma once

#include <memory>
#include <string>

#include "replay/store/store.hpp"

namespace afterglow::nodes {

struct BehaviorSource {
  std::unique_ptr<replay::Store> store;
  replay::Behavior behavior;
  std::string name;  ///< name for people
};

/// Opens a behavior: `what` selects one of the store at `store` (findBehavior()); what is a file,
/// or looks like the name of one, is a bag. A bag is read into memory, with progress on stderr.
/// Throws replay::StoreError, and std::runtime_error for a bag that cannot be read.
BehaviorSource openBehavior(const std::string& what, const std::string& store);

/// Returns how long the behavior is, seconds (endOf()).
double secondsOf(const BehaviorSource& source);

}  // namespace afterglow::nodes
