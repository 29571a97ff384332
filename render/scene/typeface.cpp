#include "render/scene/typeface.hpp"

#include <fontconfig/fontconfig.h>
#include <fribidi.h>
#include <ft2build.h>
#include <hb-ot.h>
#include <hb.h>
#include <utf8.h>
#include FT_FREETYPE_H
#include FT_OUTLINE_H

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "render/scene/closed_body.hpp"
#include "render/scene/triangulate.hpp"

namespace afterglow::render {
namespace {

/// Chords leave curves by at most this share of a capital's height.
constexpr double kFlatness = 1e-3;
constexpr int kMostChords = 64;  // a curve
constexpr std::size_t kMostFonts = 64, kMostGlyphs = 4096;  // that are kept

struct Glyph {
  std::vector<Eigen::Vector2d> points;  ///< font units
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// Outlines as FreeType tells them, curve by curve.
struct Pen {
  std::vector<Outline> outlines;
  double tolerance;

  static Eigen::Vector2d at(const FT_Vector* p) {
    return {static_cast<double>(p->x), static_cast<double>(p->y)};
  }
  void add(const Eigen::Vector2d& p) {
    if (outlines.back().empty() || outlines.back().back() != p) outlines.back().push_back(p);
  }
  int chords(double bend) const {
    return std::clamp(static_cast<int>(std::ceil(std::sqrt(bend / tolerance))), 1, kMostChords);
  }

  static int move(const FT_Vector* to, void* pen) {
    auto& self = *static_cast<Pen*>(pen);
    self.outlines.emplace_back();
    self.add(at(to));
    return 0;
  }
  static int line(const FT_Vector* to, void* pen) {
    static_cast<Pen*>(pen)->add(at(to));
    return 0;
  }
  static int conic(const FT_Vector* control, const FT_Vector* to, void* pen) {
    auto& self = *static_cast<Pen*>(pen);
    const Eigen::Vector2d a = self.outlines.back().back(), b = at(control), c = at(to);
    const int count = self.chords((a - 2 * b + c).norm() / 4);
    for (int i = 1; i <= count; ++i) {
      const double t = static_cast<double>(i) / count, s = 1 - t;
      self.add(s * s * a + 2 * s * t * b + t * t * c);
    }
    return 0;
  }
  static int cubic(const FT_Vector* first, const FT_Vector* second, const FT_Vector* to,
                   void* pen) {
    auto& self = *static_cast<Pen*>(pen);
    const Eigen::Vector2d a = self.outlines.back().back(), b = at(first), c = at(second),
                          d = at(to);
    const int count = self.chords(0.75 * std::max((a - 2 * b + c).norm(), (b - 2 * c + d).norm()));
    for (int i = 1; i <= count; ++i) {
      const double t = static_cast<double>(i) / count, s = 1 - t;
      self.add(s * s * s * a + 3 * s * s * t * b + 3 * s * t * t * c + t * t * t * d);
    }
    return 0;
  }
};

/// Bodies and the holes in them are told apart by the way they run round.
void fill(const std::vector<Outline>& outlines, bool bodies_counterclockwise, Glyph& glyph) {
  const auto isBody = [&](const Outline& outline) {
    return (signedArea(outline) > 0) == bodies_counterclockwise;
  };
  std::vector<std::vector<Outline>> holes(outlines.size());
  for (const Outline& hole : outlines) {
    if (hole.size() < 3 || isBody(hole)) continue;
    std::size_t owner = outlines.size();
    for (std::size_t i = 0; i < outlines.size(); ++i) {
      if (!isBody(outlines[i]) || !isInside(outlines[i], hole.front())) continue;
      const bool tighter = owner == outlines.size() || std::abs(signedArea(outlines[i])) <
                                                           std::abs(signedArea(outlines[owner]));
      if (tighter) owner = i;
    }
    if (owner < outlines.size()) holes[owner].push_back(hole);
  }
  for (std::size_t i = 0; i < outlines.size(); ++i) {
    if (outlines[i].size() < 3 || !isBody(outlines[i])) continue;
    const auto first = static_cast<std::uint32_t>(glyph.points.size());
    for (const auto& t : triangulate(outlines[i], holes[i])) {
      glyph.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    }
    const auto append = [&](const Outline& o) {
      glyph.points.insert(glyph.points.end(), o.begin(), o.end());
    };
    append(outlines[i]);
    for (const Outline& hole : holes[i]) append(hole);
  }
}

struct FontFile {
  std::string path;
  int index = 0;  ///< index in a collection
};

using Pattern = std::unique_ptr<FcPattern, decltype(&FcPatternDestroy)>;
using FontSet = std::unique_ptr<FcFontSet, decltype(&FcFontSetDestroy)>;

/// The file of a font with outlines; fonts of colored pictures have none.
std::optional<FontFile> fileOf(FcPattern* font) {
  FcBool has_outlines = FcTrue, is_colored = FcFalse;
  FcPatternGetBool(font, FC_OUTLINE, 0, &has_outlines);
  FcPatternGetBool(font, FC_COLOR, 0, &is_colored);
  FcChar8* file = nullptr;
  if (!has_outlines || is_colored) return std::nullopt;
  if (FcPatternGetString(font, FC_FILE, 0, &file) != FcResultMatch) return std::nullopt;
  FontFile found{reinterpret_cast<const char*>(file), 0};
  FcPatternGetInteger(font, FC_INDEX, 0, &found.index);
  found.index &= 0xffff;  // above it: an instance of a variable font
  return found;
}

/// All fonts of this machine, those most like DejaVu Sans first.
FontSet sortFonts() {
  const Pattern wanted(
      FcNameParse(reinterpret_cast<const FcChar8*>("DejaVu Sans:style=Book")), FcPatternDestroy);
  FcConfigSubstitute(nullptr, wanted.get(), FcMatchPattern);
  FcDefaultSubstitute(wanted.get());
  FcResult result = FcResultNoMatch;
  return {FcFontSort(nullptr, wanted.get(), FcTrue, nullptr, &result), FcFontSetDestroy};
}

std::string findFont() {
  const FontSet sorted = sortFonts();
  for (int i = 0; sorted && i < sorted->nfont; ++i) {
    if (const auto file = fileOf(sorted->fonts[i])) return file->path;
  }
  throw std::runtime_error("no font for text: install fonts-dejavu-core");
}

/// A font's glyphs by their numbers, and how HarfBuzz shapes with them. Font units.
class Font {
 public:
  Font(FT_Library library, const FontFile& file) {
    const bool opened = FT_New_Face(library, file.path.c_str(), file.index, &face_) == 0;
    if (!opened || !FT_IS_SCALABLE(face_)) {
      if (opened) FT_Done_Face(face_);
      throw std::runtime_error(file.path + ": no font with outlines");
    }
    hb_blob_t* blob = hb_blob_create_from_file(file.path.c_str());
    hb_face_t* shaped = hb_face_create(blob, static_cast<unsigned>(file.index));
    shaper_ = hb_font_create(shaped);
    hb_ot_font_set_funcs(shaper_);
    hb_face_destroy(shaped);
    hb_blob_destroy(blob);
    constexpr double kUsualCapital = 0.7;  // of an em, for scripts without capitals
    capital_ = capital() > 0 ? capital() : kUsualCapital * face_->units_per_EM;
  }
  ~Font() {
    hb_font_destroy(shaper_);
    FT_Done_Face(face_);
  }
  Font(const Font&) = delete;
  Font& operator=(const Font&) = delete;

  FT_Face face() const { return face_; }
  hb_font_t* shaper() const { return shaper_; }
  bool has(char32_t character) const { return FT_Get_Char_Index(face_, character) != 0; }
  /// The height of a capital H; 0: the font has none.
  double capital() const {
    if (FT_Load_Char(face_, 'H', FT_LOAD_NO_SCALE) != 0) return 0;
    return static_cast<double>(face_->glyph->metrics.horiBearingY);
  }

  const Glyph& glyph(unsigned index) {
    if (glyphs_.size() >= kMostGlyphs) glyphs_.clear();
    const auto [found, is_new] = glyphs_.try_emplace(index);
    if (is_new) found->second = load(index);
    return found->second;
  }

 private:
  Glyph load(unsigned index) const {
    Glyph glyph;
    if (FT_Load_Glyph(face_, index, FT_LOAD_NO_SCALE) != 0) return glyph;
    if (face_->glyph->format != FT_GLYPH_FORMAT_OUTLINE) return glyph;
    Pen pen{{}, kFlatness * capital_};
    const FT_Outline_Funcs funcs{Pen::move, Pen::line, Pen::conic, Pen::cubic, 0, 0};
    if (FT_Outline_Decompose(&face_->glyph->outline, &funcs, &pen) != 0) return glyph;
    for (Outline& outline : pen.outlines) {
      while (outline.size() > 1 && outline.front() == outline.back()) outline.pop_back();
    }
    const FT_Orientation way = FT_Outline_Get_Orientation(&face_->glyph->outline);
    fill(pen.outlines, way == FT_ORIENTATION_POSTSCRIPT, glyph);
    return glyph;
  }

  FT_Face face_ = nullptr;
  hb_font_t* shaper_ = nullptr;
  double capital_ = 0;
  std::map<unsigned, Glyph> glyphs_;
};

/// Joiners, marks of direction and selectors of variants: no font needs to have them.
bool isUnseen(char32_t c) {
  return c == 0xad || (c >= 0x200b && c <= 0x200f) || (c >= 0x202a && c <= 0x202e) ||
         (c >= 0x2060 && c <= 0x206f) || (c >= 0xfe00 && c <= 0xfe0f) || c == 0xfeff ||
         (c >= 0xe0100 && c <= 0xe01ef);
}

/// A font of its own, and those of this machine that have what it lacks, opened when they are
/// needed.
class Fonts {
 public:
  explicit Fonts(const FontFile& own) {
    if (FT_Init_FreeType(&library_) != 0) throw std::runtime_error("FreeType cannot start");
    try {
      fonts_.push_back(std::make_unique<Font>(library_, own));
    } catch (...) {
      FT_Done_FreeType(library_);
      throw;
    }
  }
  ~Fonts() {
    fonts_.clear();
    FT_Done_FreeType(library_);
  }
  Fonts(const Fonts&) = delete;
  Fonts& operator=(const Fonts&) = delete;

  Font& own() { return *fonts_.front(); }
  /// nullptr: none has it. `before`: the font of the character before it, which is kept for unseen
  /// characters.
  Font* find(char32_t character, Font* before) {
    if (isUnseen(character)) return before != nullptr ? before : &own();
    for (const auto& font : fonts_) {
      if (font->has(character)) return font.get();
    }
    return fonts_.size() < kMostFonts ? open(character) : nullptr;
  }

 private:
  Font* open(char32_t character) {
    if (!sorted_) sorted_ = sortFonts();
    for (int i = 0; sorted_ && i < sorted_->nfont; ++i) {
      FcCharSet* characters = nullptr;
      FcPattern* font = sorted_->fonts[i];
      const bool has = FcPatternGetCharSet(font, FC_CHARSET, 0, &characters) == FcResultMatch &&
                       FcCharSetHasChar(characters, character);
      const auto file = has ? fileOf(font) : std::nullopt;
      if (!file) continue;
      try {
        auto opened = std::make_unique<Font>(library_, *file);
        if (!opened->has(character)) continue;
        fonts_.push_back(std::move(opened));
        return fonts_.back().get();
      } catch (const std::runtime_error&) {
        continue;  // a file that is damaged, or gone meanwhile
      }
    }
    return nullptr;
  }

  FT_Library library_ = nullptr;
  std::vector<std::unique_ptr<Font>> fonts_;
  FontSet sorted_{nullptr, FcFontSetDestroy};
};

/// Characters of one font, script and direction, as they are read.
struct Run {
  std::size_t begin, end;
  Font* font;
  hb_script_t script;
  FriBidiLevel level;
};

/// Scripts whose letters need no neighbors to know their shapes: theirs are set one by one.
bool isPlain(hb_script_t script) {
  return script == HB_SCRIPT_LATIN || script == HB_SCRIPT_GREEK || script == HB_SCRIPT_CYRILLIC ||
         script == HB_SCRIPT_COMMON;
}

/// Puts runs into the order in which they are seen from the left: from the highest level down to the
/// lowest odd one, those of at least that level are turned round (Unicode Standard Annex 9, L2).
void order(std::vector<Run>& runs) {
  FriBidiLevel highest = 0, lowest_odd = std::numeric_limits<FriBidiLevel>::max();
  for (const Run& run : runs) {
    highest = std::max(highest, run.level);
    if (run.level % 2 != 0) lowest_odd = std::min(lowest_odd, run.level);
  }
  for (FriBidiLevel level = highest; level >= lowest_odd && level > 0; --level) {
    for (auto begin = runs.begin(); begin != runs.end();) {
      begin = std::find_if(begin, runs.end(), [&](const Run& r) { return r.level >= level; });
      const auto end =
          std::find_if(begin, runs.end(), [&](const Run& r) { return r.level < level; });
      std::reverse(begin, end);
      begin = end;
    }
  }
}

}  // namespace

std::u32string decodeUtf8(const std::string& text) {
  std::u32string out;
  for (auto at = text.begin(); at != text.end();) {
    const auto bad = utf8::find_invalid(at, text.end());
    utf8::utf8to32(at, bad, std::back_inserter(out));
    if (bad == text.end()) break;
    out.push_back(kReplacement);
    at = bad + 1;
  }
  return out;
}

struct Typeface::Impl {
  explicit Impl(const FontFile& file) : fonts(file) {
    capital = fonts.own().capital();
    if (capital <= 0) throw std::runtime_error(file.path + ": the font has no capitals");
  }

  Fonts fonts;
  double capital = 1;  ///< height of the own font's capitals, its units

  /// Returns the part of a line that is shaped: tabs as spaces, controls replaced, and what no font
  /// has.
  std::u32string shown(const std::u32string& line, std::vector<Font*>& found,
                       std::u32string& missing) {
    std::u32string out;
    const auto add = [&](char32_t character, Font* font) {
      out += character;
      found.push_back(font);
    };
    for (const char32_t c : line) {
      if (c == U'\r') continue;
      const bool is_control = c < 0x20 || (c >= 0x7f && c < 0xa0);
      if (c == U'\t') {
        for (int i = 0; i < 4; ++i) add(U' ', &fonts.own());
        continue;
      }
      Font* font =
          is_control ? nullptr : fonts.find(c, found.empty() ? nullptr : found.back());
      if (font == nullptr && !is_control && missing.find(c) == std::u32string::npos) missing += c;
      add(font != nullptr ? c : kReplacement, font != nullptr ? font : &fonts.own());
    }
    return out;
  }

  /// `is_right`: set to whether the line reads from the right.
  std::vector<Run> runsOf(const std::u32string& line, const std::vector<Font*>& found,
                          bool& is_right) {
    const auto count = static_cast<FriBidiStrIndex>(line.size());
    std::vector<FriBidiChar> text(line.begin(), line.end());
    std::vector<FriBidiCharType> types(line.size());
    std::vector<FriBidiBracketType> brackets(line.size());
    std::vector<FriBidiLevel> levels(line.size());
    fribidi_get_bidi_types(text.data(), count, types.data());
    fribidi_get_bracket_types(text.data(), count, types.data(), brackets.data());
    FriBidiParType base = FRIBIDI_PAR_ON;
    const FriBidiLevel highest = fribidi_get_par_embedding_levels_ex(
        types.data(), brackets.data(), count, &base, levels.data());
    if (highest == 0) std::fill(levels.begin(), levels.end(), FriBidiLevel{0});  // out of memory
    is_right = FRIBIDI_IS_RTL(base);
    hb_unicode_funcs_t* unicode = hb_unicode_funcs_get_default();
    std::vector<Run> runs;
    for (std::size_t i = 0; i < line.size(); ++i) {
      hb_script_t script = hb_unicode_script(unicode, line[i]);
      const bool is_shared = script == HB_SCRIPT_COMMON || script == HB_SCRIPT_INHERITED;
      if (!runs.empty()) {
        Run& last = runs.back();
        const bool is_same = is_shared || script == last.script || last.script == HB_SCRIPT_COMMON;
        if (is_same && last.font == found[i] && last.level == levels[i]) {
          last.end = i + 1;
          if (!is_shared) last.script = script;
          continue;
        }
      }
      runs.push_back({i, i + 1, found[i], is_shared ? HB_SCRIPT_COMMON : script, levels[i]});
    }
    order(runs);
    return runs;
  }

  /// Appends a run's glyphs from x on; returns how far it reaches. Units of the own font.
  double addRun(const std::u32string& line, const Run& run, double x, double y, double unit,
                Body& body) {
    hb_buffer_t* buffer = hb_buffer_create();
    hb_buffer_add_utf32(buffer, reinterpret_cast<const std::uint32_t*>(line.data()),
                        static_cast<int>(line.size()), static_cast<unsigned>(run.begin),
                        static_cast<int>(run.end - run.begin));
    hb_buffer_set_direction(buffer, run.level % 2 != 0 ? HB_DIRECTION_RTL : HB_DIRECTION_LTR);
    hb_buffer_set_script(buffer, run.script);
    hb_buffer_set_language(buffer, hb_language_from_string("en", -1));
    const hb_feature_t one_by_one[] = {{HB_TAG('k', 'e', 'r', 'n'), 0, 0, ~0u},
                                       {HB_TAG('l', 'i', 'g', 'a'), 0, 0, ~0u},
                                       {HB_TAG('c', 'l', 'i', 'g'), 0, 0, ~0u}};
    hb_shape(run.font->shaper(), buffer, one_by_one, isPlain(run.script) ? 3 : 0);
    unsigned count = 0;
    const hb_glyph_info_t* glyphs = hb_buffer_get_glyph_infos(buffer, &count);
    const hb_glyph_position_t* places = hb_buffer_get_glyph_positions(buffer, &count);
    const double scale = static_cast<double>(fonts.own().face()->units_per_EM) /
                         static_cast<double>(run.font->face()->units_per_EM);
    for (unsigned i = 0; i < count; ++i) {
      const Eigen::Vector2d at(x + scale * places[i].x_offset, y + scale * places[i].y_offset);
      add(run.font->glyph(glyphs[i].codepoint), at, scale, unit, body);
      x += scale * places[i].x_advance;
    }
    hb_buffer_destroy(buffer);
    return x;
  }

  static void add(const Glyph& shape, const Eigen::Vector2d& at, double scale, double unit,
                  Body& body) {
    const auto first = static_cast<std::uint32_t>(body.points.size());
    for (const Eigen::Vector2d& p : shape.points) {
      const Eigen::Vector2d placed = unit * (scale * p + at);
      body.points.emplace_back(static_cast<float>(placed.x()), static_cast<float>(placed.y()), 0);
    }
    for (const auto& t : shape.triangles) {
      body.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    }
  }

  struct Line {
    std::size_t first_point;
    double length;
    bool is_right;  ///< true: it reads from the right
  };

  /// A line from x = 0 on its baseline.
  Line addLine(const std::u32string& line, double y, double unit, TextBlock& block) {
    Line added{block.letters.points.size(), 0, false};
    std::vector<Font*> found;
    const std::u32string text = shown(line, found, block.missing);
    if (text.empty()) return added;
    for (const Run& run : runsOf(text, found, added.is_right)) {
      added.length = addRun(text, run, added.length, y, unit, block.letters);
    }
    return added;
  }
};

Typeface::Typeface() : Typeface(findFont()) {}

Typeface::Typeface(const std::string& path) : impl_(std::make_unique<Impl>(FontFile{path, 0})) {}

Typeface::~Typeface() = default;

TextBlock Typeface::set(const std::u32string& text, double capital_height) {
  const double unit = capital_height / impl_->capital;
  const double pitch = static_cast<double>(impl_->fonts.own().face()->height);
  const auto breaks = static_cast<double>(std::count(text.begin(), text.end(), U'\n'));
  double y = (breaks * pitch - impl_->capital) / 2, longest = 0;
  TextBlock block;
  std::vector<Impl::Line> lines;
  for (std::size_t begin = 0; begin <= text.size(); y -= pitch) {
    const std::size_t end = std::min(text.find(U'\n', begin), text.size());
    lines.push_back(impl_->addLine(text.substr(begin, end - begin), y, unit, block));
    longest = std::max(longest, lines.back().length);
    begin = end + 1;
  }
  std::vector<Eigen::Vector3f>& points = block.letters.points;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const double indent = lines[i].is_right ? longest - lines[i].length : 0;
    const auto shift = static_cast<float>((indent - 0.5 * longest) * unit);
    const std::size_t end = i + 1 < lines.size() ? lines[i + 1].first_point : points.size();
    for (std::size_t k = lines[i].first_point; k < end; ++k) points[k].x() += shift;
  }
  findOutline(block.letters);
  return block;
}

}  // namespace afterglow::render
