/// \file
/// Which texts are UTF-8 (RFC 3629: no overlong forms, no surrogates, nothing beyond U+10FFFF). A
/// ROS string may hold any bytes. Internal to replay.
#pragma once

#include <cstddef>
#include <string_view>

namespace afterglow::replay {

/// Length of the character at the front of a text that is not empty; 0 if there is none.
std::size_t utf8Length(std::string_view text);

bool isUtf8(std::string_view text);

}  // namespace afterglow::replay
