/// \file
/// Whether a ROS master answers, asked before ros::init: with a parameter on the command line
/// (_name:=value) that one waits for a master forever.
#pragma once

namespace afterglow::nodes {

/// The master of ROS_MASTER_URI or of an argument __master:=URI. Throws std::runtime_error, one
/// line with its URI, if it does not answer.
void requireMaster(int argc, char** argv);

}  // namespace afterglow::nodes
