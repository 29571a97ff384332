/// \file
/// Points by depth, in time that grows with their number alone.
#pragma once

#include <cstddef>
#include <vector>

#include "render/paint/screen_point.hpp"

namespace afterglow::render {

/// Sorts a copy by `order`, keeping the order of equals. What it returns lies within `room`, which
/// grows as needed, or is `points` itself, and holds until the next call.
const ScreenPoint* sortByOrder(const ScreenPoint* points, std::size_t count,
                               std::vector<ScreenPoint>& room);

}  // namespace afterglow::render
