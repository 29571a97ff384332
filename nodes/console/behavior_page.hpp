/// \file
/// A behavior as one self-contained page, to be mailed to somebody.
#pragma once

#include <string>
#include <vector>

#include "nodes/console/behavior_detail.hpp"

namespace afterglow::nodes {

/// A picture of one of its moments.
struct MomentImage {
  double t = 0;  ///< seconds since its begin
  std::string view;  ///< for people: "projector"
  std::string jpeg;
  std::vector<std::string> dark;  ///< what is not lit, and why, a line each
};

/// Story, images, timeline and what was said, from the template behavior.html. `film`: the bytes of
/// an MP4 file of the whole behavior, which gets what was said as a text track; or empty.
std::string behaviorPage(const BehaviorDetail& detail, const std::vector<MomentImage>& images,
                         const std::string& film = "");

}  // namespace afterglow::nodes
