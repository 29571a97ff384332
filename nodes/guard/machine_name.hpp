/// \file
/// Comparison of two programs' machines. C++14 (guard_messages.hpp).
#pragma once

#include <string>

namespace afterglow {
namespace nodes {

/// The same for all programs of a running machine that share a network, and for no others; empty if
/// that cannot be found out.
std::string machineName();

}  // namespace nodes
}  // namespace afterglow
