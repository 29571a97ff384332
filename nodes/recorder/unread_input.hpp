/// \file
/// The backlog of this process's network input.
#pragma once

namespace afterglow::nodes {

/// True if a socket of this process holds bytes that were not read yet. roscpp does not say.
bool hasUnreadInput();

}  // namespace afterglow::nodes
