/// \file
/// A behavior that a verb is given by its id or as a bag, and the store it lies in.
#pragma once

#include <memory>
#include <string>

#include "replay/store/store.hpp"

namespace afterglow::nodes {

struct BehaviorSource {
  std::unique_ptr<replay::Store> store;
  replay::Behavior behavior;
  std::string name;  ///< for people
};

/// `what` is an id in the store at `store`, else a bag's path; a bag is read into memory, with
/// progress on stderr. Throws replay::StoreError, and std::runtime_error for a bag that cannot be
/// read.
BehaviorSource openBehavior(const std::string& what, const std::string& store);

}  // namespace afterglow::nodes
