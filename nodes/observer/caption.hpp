/// \file
/// Words on the images of a video, so that a stranger understands what is going on.
#pragma once

#include <memory>
#include <string>

#include "render/scene/image.hpp"

namespace afterglow::nodes {

/// UTF-8, one line each, drawn smaller where the image is too narrow. Empty parts are left out.
struct Caption {
  std::string tag;     ///< a word or two in a colored field before the text: "live", "replay"
  std::string text;    ///< what is being shown
  std::string speech;  ///< what is being said
};

/// "TAG|TEXT" or "TEXT" as it comes in one message.
Caption parseCaption(const std::string& message);

/// Text is as large as the image asks for. One thread at a time.
class CaptionPainter {
 public:
  /// Throws std::runtime_error naming the font file that cannot be read.
  explicit CaptionPainter(const std::string& font = defaultFont());
  ~CaptionPainter();

  /// A dark, translucent bar along the bottom; nothing if the caption is empty.
  void paint(render::Image& image, const Caption& caption);
  /// A small image in a box with its label in the upper right corner.
  void paintInset(render::Image& image, const render::Image& inset, const std::string& label);

  /// DejaVu Sans where Debian and Ubuntu keep it.
  static std::string defaultFont();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace afterglow::nodes
