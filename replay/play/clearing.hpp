/// \file
/// The message that clears a topic of projected content. Semantics: rviz's
/// displays (an empty cloud, path or scan shows nothing; DELETEALL removes every marker of a
/// topic).
#pragma once

#include <optional>

#include "replay/messages/message.hpp"

namespace afterglow::replay {

/// Empties PointCloud2 (keeps its fields), LaserScan, Path, Marker and MarkerArray; empty for every
/// other type, and for a `last` message that does not fit its definition. `last` gives the frame.
/// Stamps are left at 0, "whenever".
std::optional<Bytes> clearingMessage(const Channel& channel, const Bytes& last);

}  // namespace afterglow::replay
