#include "render/scene/typeface.hpp"

#include <fontconfig/fontconfig.h>
#include <ft2build.h>
#include FT_FREETYPE_H
#include FT_OUTLINE_H

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <vector>

#include "render/scene/closed_body.hpp"
#include "render/scene/outline.hpp"
#include "render/scene/triangulate.hpp"
#include "render/scene/utf8.hpp"

namespace afterglow::render {
namespace {

/// Chords leave curves by at most this share of a capital's height.
constexpr double kFlatness = 1e-3;
constexpr int kMostChords = 64;  // a curve

struct Glyph {
  double advance = 0;  ///< font units, as its points
  std::vector<Eigen::Vector2d> points;
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

std::string findFont() {
  FcPattern* wanted = FcNameParse(reinterpret_cast<const FcChar8*>("DejaVu Sans:style=Book"));
  FcConfigSubstitute(nullptr, wanted, FcMatchPattern);
  FcDefaultSubstitute(wanted);
  FcResult result = FcResultNoMatch;
  FcPattern* found = FcFontMatch(nullptr, wanted, &result);
  FcPatternDestroy(wanted);
  FcChar8* file = nullptr;
  std::string path;
  if (found != nullptr && FcPatternGetString(found, FC_FILE, 0, &file) == FcResultMatch) {
    path = reinterpret_cast<const char*>(file);
  }
  if (found != nullptr) FcPatternDestroy(found);
  if (path.empty()) throw std::runtime_error("no font for text: install fonts-dejavu-core");
  return path;
}

}  // namespace

struct Typeface::Impl {
  FT_Library library = nullptr;
  FT_Face face = nullptr;
  double capital = 1;  ///< font units
  std::map<char32_t, Glyph> glyphs;

  ~Impl() {
    if (face != nullptr) FT_Done_Face(face);
    if (library != nullptr) FT_Done_FreeType(library);
  }

  Glyph load(char32_t character) const {
    Glyph glyph;
    const FT_UInt index = FT_Get_Char_Index(face, character);  // 0: the font's own box
    if (FT_Load_Glyph(face, index, FT_LOAD_NO_SCALE) != 0) return glyph;
    glyph.advance = static_cast<double>(face->glyph->metrics.horiAdvance);
    if (face->glyph->format != FT_GLYPH_FORMAT_OUTLINE) return glyph;
    Pen pen{{}, kFlatness * capital};
    const FT_Outline_Funcs funcs{Pen::move, Pen::line, Pen::conic, Pen::cubic, 0, 0};
    if (FT_Outline_Decompose(&face->glyph->outline, &funcs, &pen) != 0) return glyph;
    for (Outline& outline : pen.outlines) {
      while (outline.size() > 1 && outline.front() == outline.back()) outline.pop_back();
    }
    const FT_Orientation way = FT_Outline_Get_Orientation(&face->glyph->outline);
    fill(pen.outlines, way == FT_ORIENTATION_POSTSCRIPT, glyph);
    return glyph;
  }

  const Glyph& glyph(char32_t character) {
    const bool control = character < 0x20 || (character >= 0x7f && character < 0xa0);
    // One glyph for all that the font lacks, or a million foreign characters would be kept.
    if (control || FT_Get_Char_Index(face, character) == 0) character = kReplacement;
    const auto found = glyphs.find(character);
    return found != glyphs.end() ? found->second
                                 : glyphs.emplace(character, load(character)).first->second;
  }

  /// A line from x = 0 on its baseline; returns its length. Font units.
  double addLine(const std::u32string& line, double y, double unit, Body& body) {
    double x = 0;
    for (const char32_t character : line) {
      if (character == U'\r') continue;
      if (character == U'\t') {
        x += 4 * glyph(U' ').advance;
        continue;
      }
      const Glyph& shape = glyph(character);
      const auto first = static_cast<std::uint32_t>(body.points.size());
      for (const Eigen::Vector2d& p : shape.points) {
        const Eigen::Vector2d placed = unit * (p + Eigen::Vector2d(x, y));
        body.points.emplace_back(static_cast<float>(placed.x()), static_cast<float>(placed.y()), 0);
      }
      for (const auto& t : shape.triangles) {
        body.triangles.push_back({first + t[0], first + t[1], first + t[2]});
      }
      x += shape.advance;
    }
    return x;
  }
};

Typeface::Typeface() : Typeface(findFont()) {}

Typeface::Typeface(const std::string& path) : impl_(std::make_unique<Impl>()) {
  const bool opened = FT_Init_FreeType(&impl_->library) == 0 &&
                      FT_New_Face(impl_->library, path.c_str(), 0, &impl_->face) == 0;
  if (!opened || !FT_IS_SCALABLE(impl_->face)) {
    throw std::runtime_error(path + ": no font with outlines");
  }
  if (FT_Load_Char(impl_->face, 'H', FT_LOAD_NO_SCALE) != 0 ||
      impl_->face->glyph->metrics.horiBearingY <= 0) {
    throw std::runtime_error(path + ": the font has no capitals");
  }
  impl_->capital = static_cast<double>(impl_->face->glyph->metrics.horiBearingY);
}

Typeface::~Typeface() = default;

Body Typeface::block(const std::u32string& text, double capital_height) {
  const double unit = capital_height / impl_->capital;
  const double pitch = static_cast<double>(impl_->face->height);
  const auto breaks = static_cast<double>(std::count(text.begin(), text.end(), U'\n'));
  double y = (breaks * pitch - impl_->capital) / 2, longest = 0;
  Body body;
  for (std::size_t begin = 0; begin <= text.size(); y -= pitch) {
    const std::size_t end = std::min(text.find(U'\n', begin), text.size());
    longest = std::max(longest, impl_->addLine(text.substr(begin, end - begin), y, unit, body));
    begin = end + 1;
  }
  const auto shift = static_cast<float>(-0.5 * longest * unit);
  for (Eigen::Vector3f& p : body.points) p.x() += shift;
  findOutline(body);
  return body;
}

}  // namespace afterglow::render
