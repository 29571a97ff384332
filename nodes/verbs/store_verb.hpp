/// \file
/// `afterglow store`: checks, repairs, compacts, measures and prunes a store.
#pragma once

#include <CLI/App.hpp>

namespace afterglow::nodes {

constexpr const char* kStoreHelp = "Look after a store in a SQLite file";

/// Registers the verb; parsing it does the job. Failures are exceptions.
void addStoreVerb(CLI::App& app);

}  // namespace afterglow::nodes
