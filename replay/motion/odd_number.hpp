/// \file
/// Numbers that no robot should be told: NaN and infinity.
#pragma once

#include <string>

#include "replay/messages/document.hpp"
#include "replay/messages/message.hpp"
#include "replay/messages/schema.hpp"

namespace afterglow::replay {

/// The first number of a message that is infinite or none: "points[2].positions[0] is nan"; empty:
/// there is none.
std::string oddNumber(const Value& document);
/// Throws MessageError for bytes that do not fit.
std::string oddNumber(const Schema& schema, const Bytes& bytes);

}  // namespace afterglow::replay
