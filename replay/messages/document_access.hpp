/// \file
/// Fields of a decoded message, by path.
#pragma once

#include <string>
#include <vector>

#include "replay/messages/document.hpp"

namespace afterglow::replay {

/// The value at a path ("goal.trajectory.header"); null if a name on the way is missing.
const Value* findValue(const Value& message, const std::string& path);
Value* findValue(Value& message, const std::string& path);

/// The same; throws MessageError if it is missing.
Value& valueAt(Value& message, const std::string& path);

/// The elements of a float64[]; empty for every other value.
std::vector<double> numbersOf(const Value& value);
/// Those of a field; empty if it is missing.
std::vector<double> numbersAt(const Value& message, const std::string& path);
NumberArray numberArray(const std::vector<double>& numbers);

RosDuration toRosDuration(std::int64_t ns);

}  // namespace afterglow::replay
