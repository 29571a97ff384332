/// \file
/// Words on the images of a video, so that a stranger understands what is going on.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "render/scene/image.hpp"

namespace afterglow::nodes {

/// UTF-8, one line each, drawn smaller where the image is too narrow. Empty parts are left out.
struct Caption {
  std::string tag;     ///< a word or two in a colored field before the text: "live", "replay"
  std::string text;    ///< words on what is being shown
  std::string speech;  ///< the robot's words now
  std::string asked = {};  ///< a human's question, shown in place of `text`
  bool has_ghosts = false;  ///< says in the corner of the strip what gray solids are
};

/// Returns the height of the strip below images of that width, pixels; even.
int stripHeight(int width);

/// Part of an image, pixels.
struct ImagePart {
  int left, top, width, height;
};
/// The part of a mostly dark image that has the light in it, with the image's own proportions. In
/// steps of an eighth of the image, so that it stays where the light moves a little.
std::optional<ImagePart> litPart(const render::Image& image);

/// Text is as large as the image asks for. One thread at a time.
class CaptionPainter {
 public:
  /// Throws std::runtime_error naming the font file that cannot be read.
  explicit CaptionPainter(const std::string& font = defaultFont());
  ~CaptionPainter();

  /// The image, untouched, above a dark strip of stripHeight() with the caption.
  render::Image withStrip(const render::Image& image, const Caption& caption);
  /// Writes on a colored field in the upper left corner.
  void paintLabel(render::Image& image, const std::string& label);
  /// Writes large across the middle, on a dark band.
  void paintTitle(render::Image& image, const std::string& title);
  /// The lit part of a projector's image in a box with its label in the upper right corner; nothing
  /// where all of it is dark.
  void paintInset(render::Image& image, const render::Image& inset, const std::string& label);

  /// DejaVu Sans where Debian and Ubuntu keep it.
  static std::string defaultFont();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace afterglow::nodes
