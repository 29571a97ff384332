/// \file
/// Text as triangles: exact light through a lens at any size, with no texture in between.
#pragma once

#include <memory>
#include <string>

#include "render/scene/scene.hpp"

namespace afterglow::render {

/// Stands for a character that cannot be shown.
constexpr char32_t kReplacement = U'\uFFFD';

/// Decodes UTF-8; every byte that is part of no character (overlong forms, surrogates and what is
/// beyond Unicode among them) becomes a kReplacement.
std::u32string decodeUtf8(const std::string& text);

/// Text as lines of letters, and what of it no font has.
struct TextBlock {
  Body letters;
  std::u32string missing;  ///< missing characters, each once; drawn as replacement characters
};

/// Outlines of fonts (FreeType), curves as chords within 1/2000 of a capital's height: of its own
/// font, and for what that lacks of the nearest one that fontconfig knows. Keeps the glyphs it has
/// drawn. One thread at a time.
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
  /// RViz's MovableText), those that read from the right at the right. A capital H is
  /// `capital_height` high; lines are as far apart as the font has them. Each line is ordered by
  /// Unicode's bidirectional algorithm (FriBidi) and shaped (HarfBuzz), without kerning and
  /// ligatures where a script does not need them. Control characters are the replacement
  /// character's glyph; a tab is four spaces; carriage returns are nothing.
  TextBlock set(const std::u32string& text, double capital_height);
  /// Returns the letters alone.
  Body block(const std::u32string& text, double capital_height) {
    return set(text, capital_height).letters;
  }

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace afterglow::render
