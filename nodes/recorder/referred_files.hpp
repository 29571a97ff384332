/// \file
/// Keeps the sounds and meshes that recorded messages refer to, as they are now.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "replay/store/store.hpp"

namespace afterglow::nodes {

/// SHA-256 by URI of those that the store now has. Others are remarked upon: missing,
/// over 20 MiB, neither package:// nor file://, by its name no sound and no mesh, or elsewhere: a
/// message may name any file of this machine, and a link may lead to any other. A file's real path
/// must lie in its package, for file:// in one of `roots`, a ROS package or /usr/share/sounds.
/// Throws StoreError.
std::map<std::string, std::string> keepFiles(replay::Store& store,
                                             const std::set<std::string>& uris,
                                             const std::vector<std::string>& roots,
                                             std::vector<std::string>& remarks);

/// Returns true if a "package://" or "file://" URI names a file of this machine.
bool isHere(const std::string& uri);

}  // namespace afterglow::nodes
