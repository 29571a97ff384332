/// \file
/// A verb as a ROS node: under a name that no other node takes, and without a log topic.
#pragma once

#include <string>

namespace afterglow::nodes {

/// Names this process as a node, which asks the master nothing yet. Without ROS_MASTER_URI the
/// master is http://localhost:11311. Throws std::runtime_error, one line, if that is no URI:
/// roscpp would end the process.
void nameVerbNode(const std::string& name);

/// The same, and throws if no master answers, for which roscpp would wait forever.
void startVerbNode(const std::string& name);

/// Prints roscpp's own words only from the level of warnings on from now on.
void printWarningsOnly();

}  // namespace afterglow::nodes
