/// \file
/// A node's ~store.
#pragma once

#include <ros/node_handle.h>

#include <string>

namespace afterglow::nodes {

/// Throws replay::StoreError for a URI with a password, which everybody on the network can read:
/// the parameter is deleted then.
void refuseStorePassword(const ros::NodeHandle& private_node, const std::string& store);

}  // namespace afterglow::nodes
