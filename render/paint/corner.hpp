/// \file
/// The coordinates of outlines' corners.
#pragma once

namespace afterglow::render {

/// A corner on the image; pixel i spans [i, i + 1).
struct Corner {
  float x, y;
};

}  // namespace afterglow::render
