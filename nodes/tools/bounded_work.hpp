/// \file
/// Work that may hang or crash (drivers, displays, servers), done by a process of its own.
#pragma once

#include <functional>
#include <string>

namespace afterglow::nodes {

/// Forks, and returns what `work` returns there, at most 64 KiB. Throws std::runtime_error, one
/// line, with what `work` threw, with the signal that ended it, or if it has not ended within
/// `seconds`; then it is killed. To be called while this process has one thread.
std::string boundedWork(double seconds, const std::function<std::string()>& work);

}  // namespace afterglow::nodes
