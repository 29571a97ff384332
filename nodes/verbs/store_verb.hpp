/// \file
/// `afterglow store`: checks, repairs, compacts, measures and prunes a store.
#pragma once

#include <CLI/App.hpp>

namespace afterglow::nodes {

void addStoreVerb(CLI::App& app);

}  // namespace afterglow::nodes
