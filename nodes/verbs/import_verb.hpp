/// \file
/// `afterglow import`: bags, or a database of mongodb_log, into the store.
#pragma once

#include <CLI/App.hpp>

namespace afterglow::nodes {

constexpr const char* kImportHelp = "Import bags, one behavior each, or a database of mongodb_log";

/// Registers the verb; parsing it does the job. Failures are exceptions.
void addImportVerb(CLI::App& app);

}  // namespace afterglow::nodes
