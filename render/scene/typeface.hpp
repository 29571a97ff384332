/// \file
/// Text as triangles: exact light through a lens at any size, with no texture in between.
#pragma once

#include <memory>
#include <string>

#include "render/scene/scene.hpp"

namespace afterglow::render {

/// One font's outlines (FreeType), curves as chords within 1/2000 of a capital's height. Keeps
/// every character it has drawn. One thread at a time.
class Typeface {
 public:
  /// DejaVu Sans, or what fontconfig finds nearest to it. Throws std::runtime_error: no font, and
  /// what to install.
  Typeface();
  /// Throws std::runtime_error naming the file.
  explicit Typeface(const std::string& path);
  ~Typeface();
  Typeface(const Typeface&) = delete;
  Typeface& operator=(const Typeface&) = delete;

  /// A block of lines around the origin, x along the lines, y up, meters: centered by its longest
  /// line, and from the first line's capitals to the last baseline; lines begin at the left (as
  /// RViz's MovableText). A capital H is `capital_height` high; lines are as far apart as the font
  /// has them. What the font lacks and control characters are the replacement character's glyph; a
  /// tab is four spaces; carriage returns are nothing. Left to right, one glyph a character.
  Body block(const std::u32string& text, double capital_height);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace afterglow::render
