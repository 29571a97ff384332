/// \file
/// A behavior as one self-contained page, to be mailed to somebody.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "nodes/behavior_view/behavior_story.hpp"

namespace afterglow::nodes {

/// The projector's image, or the room that it lights as a bystander sees it.
enum class PictureView { Projector, Bystander };

/// A picture of a moment, as a file holds it.
struct MomentJpeg {
  std::string jpeg;
  std::vector<std::string> dark;  ///< things that are not lit, and why, a line each
};

/// Draws the moment so many seconds after the behavior's begin. Throws std::runtime_error where it
/// cannot be drawn.
using DrawMoment = std::function<MomentJpeg(PictureView view, double t)>;
constexpr int kPagePictureWidth = 640;  ///< pixels

/// Makes the page from the template behavior.html: story, pictures of the key moments where they
/// can be drawn, timeline and what was said. An empty `draw` draws nothing. `film`: the bytes of an
/// MP4 file of the whole behavior, which gets what was said as a text track; or empty.
std::string behaviorPage(const BehaviorDetail& detail, const DrawMoment& draw,
                         const std::string& film = "");

}  // namespace afterglow::nodes
