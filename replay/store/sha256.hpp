/// \file
/// The name by which the store keeps a file.
#pragma once

#include <string>

#include "replay/messages/message.hpp"

namespace afterglow::replay {

/// 64 hex digits.
std::string sha256(const Bytes& contents);

}  // namespace afterglow::replay
