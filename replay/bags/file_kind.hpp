/// \file
/// Files that are given for recordings and are something else, told by their first bytes. Internal
/// to replay.
#pragma once

#include <string>
#include <string_view>

namespace afterglow::replay {

/// Says what the file is instead of a recording, and the way out; empty: it may be one. `beginning`
/// holds its first 512 bytes, or all of them.
std::string otherThanRecording(std::string_view beginning);

}  // namespace afterglow::replay
