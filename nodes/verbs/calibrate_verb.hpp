/// \file
/// `afterglow calibrate`: boards, patterns, and what is solved with them; a file a sub-verb.
#pragma once

#include <CLI/App.hpp>

namespace afterglow::nodes {

constexpr const char* kCalibrateHelp =
    "Calibrate a projector with printed and projected tags";

/// Registers the verb and its sub-verbs; parsing one does the job. Failures are exceptions.
void addCalibrateVerb(CLI::App& app);

}  // namespace afterglow::nodes
