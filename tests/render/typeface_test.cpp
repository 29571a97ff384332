// Text as triangles: sizes, lines, every glyph of the font, hostile strings.
#include "render/scene/typeface.hpp"

#include <fontconfig/fontconfig.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "render/scene/triangulate.hpp"

namespace afterglow::render::typeface_test {
namespace {

double area(const Body& body) {
  double sum = 0;
  for (const auto& t : body.triangles) {
    const Eigen::Vector3f a = body.points[t[1]] - body.points[t[0]];
    const Eigen::Vector3f b = body.points[t[2]] - body.points[t[0]];
    sum += 0.5 * std::abs(static_cast<double>(a.x() * b.y() - a.y() * b.x()));
  }
  return sum;
}

Eigen::AlignedBox2d box(const Body& body) {
  Eigen::AlignedBox2d box;
  for (const auto& t : body.triangles) {
    for (const auto i : t) box.extend(body.points[i].head<2>().cast<double>());
  }
  return box;
}

double areaOf(const std::vector<std::array<std::uint32_t, 3>>& triangles, const Outline& points) {
  double sum = 0;
  for (const auto& t : triangles) {
    sum += std::abs(signedArea({points[t[0]], points[t[1]], points[t[2]]}));
  }
  return sum;
}

TEST(Triangulate, coversAnOutlineWithoutItsHoles) {
  const Outline outer = {{0, 0}, {10, 0}, {10, 10}, {5, 6}, {0, 10}};
  // The other way round, side by side, and one with a corner level with another's.
  const std::vector<Outline> holes = {
      {{1, 1}, {3, 1}, {3, 3}, {1, 3}}, {{6, 1}, {6, 3}, {8, 3}, {8, 1}}, {{4, 4}, {5, 3}, {6, 4}}};
  Outline points = outer;
  double expected = signedArea(outer);
  for (const Outline& hole : holes) {
    points.insert(points.end(), hole.begin(), hole.end());
    expected -= std::abs(signedArea(hole));
  }
  const auto triangles = triangulate(outer, holes);
  EXPECT_NEAR(areaOf(triangles, points), expected, 1e-9);
  for (const auto& t : triangles) {
    const Eigen::Vector2d middle = (points[t[0]] + points[t[1]] + points[t[2]]) / 3;
    EXPECT_TRUE(isInside(outer, middle));
    for (const Outline& hole : holes) EXPECT_FALSE(isInside(hole, middle));
  }
}

TEST(Triangulate, survivesOutlinesThatAreNone) {
  EXPECT_TRUE(triangulate({}, {}).empty());
  EXPECT_TRUE(triangulate({{0, 0}, {1, 1}}, {}).empty());
  EXPECT_TRUE(triangulate({{0, 0}, {1, 0}, {2, 0}, {3, 0}}, {}).empty());
  EXPECT_LE(triangulate({{0, 0}, {2, 2}, {2, 0}, {0, 2}}, {}).size(), 2u);  // crosses itself
  EXPECT_FALSE(triangulate({{0, 0}, {1, 0}, {0, 1}}, {{{5, 5}, {6, 5}, {5, 6}}}).empty());
}

TEST(Typeface, makesACapitalAsHighAsAsked) {
  Typeface typeface;
  const auto letter = box(typeface.block(U"H", 0.25));
  EXPECT_NEAR(letter.max().y(), 0.125, 1e-6);
  EXPECT_NEAR(letter.min().y(), -0.125, 1e-6);
  EXPECT_NEAR(letter.center().x(), 0, 0.005);  // by its advance, not its ink
  const auto other = box(typeface.block(U"A", 0.25));
  EXPECT_NEAR(other.max().y() - other.min().y(), 0.25, 1e-3);
}

TEST(Typeface, putsLinesBelowEachOtherFromTheLeft) {
  Typeface typeface;
  const auto one = box(typeface.block(U"HHHH", 1));
  const auto two = box(typeface.block(U"HHHH\nH", 1));
  const double pitch = two.max().y() - two.min().y() - 1;
  EXPECT_GT(pitch, 1.3);
  EXPECT_LT(pitch, 2);
  EXPECT_NEAR(two.center().y(), 0, 1e-6);
  EXPECT_NEAR(two.min().x(), one.min().x(), 1e-6);
  EXPECT_NEAR(two.max().x(), one.max().x(), 1e-6);
  const Body lines = typeface.block(U"HHHH\nH", 1);
  Eigen::AlignedBox2d below;
  for (const auto& p : lines.points) {
    if (p.y() < 0) below.extend(p.head<2>().cast<double>());
  }
  EXPECT_NEAR(below.min().x(), one.min().x(), 1e-6);
}

/// The inside of every outline is covered once: where bodies do not overlap and nothing but chords
/// comes in between, areas add up.
TEST(Typeface, coversEveryGlyphExactly) {
  Typeface typeface;
  const double ring = area(typeface.block(U"O", 1)), disc = area(typeface.block(U"\u25cf", 1));
  EXPECT_GT(ring, 0.1);
  EXPECT_GT(disc, ring * 0.3);
  // A full block is a rectangle: its box is its area.
  const Body full = typeface.block(U"\u2588", 1);
  EXPECT_NEAR(area(full), box(full).volume(), 1e-4);
  // Letters with holes, accents and several bodies, against even-odd sampling of their triangles:
  // nothing is covered twice.
  for (const char32_t c :
       std::u32string(U"AaBbDdegOoPpQqR046889%&@#\u00c5\u00f8\u03a6\u0416\u00e4")) {
    const Body body = typeface.block({c}, 1);
    const auto bounds = box(body);
    int once = 0, often = 0, total = 0;
    for (double y = bounds.min().y() + 0.003; y < bounds.max().y(); y += 0.0171) {
      for (double x = bounds.min().x() + 0.003; x < bounds.max().x(); x += 0.0173, ++total) {
        int count = 0;
        for (const auto& t : body.triangles) {
          Outline corners;
          for (const auto i : t) corners.push_back(body.points[i].head<2>().cast<double>());
          count += isInside(corners, {x, y});
        }
        once += count == 1;
        often += count > 1;
      }
    }
    EXPECT_EQ(often, 0) << static_cast<unsigned>(c);
    EXPECT_NEAR(static_cast<double>(once) / total, area(body) / bounds.volume(), 0.02)
        << static_cast<unsigned>(c);
  }
}

TEST(Typeface, drawsWhatTheFontLacksAsAReplacement) {
  Typeface typeface;
  const double replacement = area(typeface.block({kReplacement}, 1));
  EXPECT_GT(replacement, 0);
  EXPECT_EQ(area(typeface.block({U'\0'}, 1)), replacement);
  EXPECT_EQ(area(typeface.block({U'\x1b'}, 1)), replacement);
  const TextBlock unknown = typeface.set(U"\U0010FFFD\U0010FFFC\U0010FFFD", 1);  // private use
  EXPECT_EQ(unknown.missing, U"\U0010FFFD\U0010FFFC") << "each is named once";
  EXPECT_NEAR(area(unknown.letters), 3 * replacement, 1e-5);
  EXPECT_TRUE(typeface.set(U"\x1b known\u200d\ufe0f", 1).missing.empty());
  EXPECT_EQ(area(typeface.block({char32_t{0xFFFFFFFF}}, 1)), replacement);
  EXPECT_TRUE(typeface.block(U"", 1).triangles.empty());
  EXPECT_TRUE(typeface.block(U" \n\t\r\n ", 1).triangles.empty());
}

/// Where the letters of a text stand, from the left, by their area: of equal areas, equal letters.
std::vector<double> areasFromTheLeft(Typeface& typeface, const std::u32string& text,
                                     std::size_t letters) {
  const Body body = typeface.block(text, 1);
  const auto bounds = box(body);
  std::vector<double> areas(letters);
  const double width = (bounds.max().x() - bounds.min().x()) / static_cast<double>(letters);
  for (const auto& t : body.triangles) {
    const Eigen::Vector3f middle =
        (body.points[t[0]] + body.points[t[1]] + body.points[t[2]]) / 3;
    const auto place = static_cast<std::size_t>(
        std::clamp((static_cast<double>(middle.x()) - bounds.min().x()) / width, 0.0,
                   static_cast<double>(letters) - 1));
    Body one;
    one.points = body.points;
    one.triangles = {t};
    areas[place] += area(one);
  }
  return areas;
}

// Unicode Standard Annex 9: Hebrew reads from the right, numbers within it from the left.
TEST(Typeface, ordersHebrewFromTheRightAndNumbersWithinItFromTheLeft) {
  Typeface typeface;
  const Body shalom = typeface.block(U"\u05e9\u05dc\u05d5\u05dd", 1);  // shin lamed vav mem
  const Body mem = typeface.block(U"\u05dd", 1), shin = typeface.block(U"\u05e9", 1);
  const auto leftmost = [](const Body& body, double width) {
    const double left = box(body).min().x();
    double sum = 0;
    for (const auto& t : body.triangles) {
      const bool is_left = std::all_of(t.begin(), t.end(), [&](auto i) {
        return static_cast<double>(body.points[i].x()) < left + width;
      });
      Body one;
      one.points = body.points;
      one.triangles = {t};
      sum += is_left ? area(one) : 0;
    }
    return sum;
  };
  const double width = box(mem).max().x() - box(mem).min().x();
  EXPECT_NEAR(leftmost(shalom, width + 0.02), area(mem), 1e-3) << "the last letter is leftmost";
  EXPECT_GT(std::abs(area(mem) - area(shin)), 0.01) << "they can be told apart";
  // "1" and "0" keep their order between Hebrew letters.
  const auto areas = areasFromTheLeft(typeface, U"10", 2);
  const auto within = typeface.block(U"\u05d0 10", 1);
  EXPECT_NEAR(area(within), area(typeface.block(U"\u05d0", 1)) + areas[0] + areas[1], 1e-3);
  EXPECT_NEAR(leftmost(within, 0.75), areas[0], 0.02) << "the line's left end begins with 1";
}

TEST(Typeface, beginsLinesThatReadFromTheRightAtTheRight) {
  Typeface typeface;
  const Body lines = typeface.block(U"\u05e9\u05dc\u05d5\u05dd\u05e9\u05dc\n\u05dd", 1);
  const auto whole = box(lines);
  double left = 10;
  for (const auto& p : lines.points) {
    if (p.y() < -0.3f) left = std::min(left, static_cast<double>(p.x()));
  }
  EXPECT_GT(left, whole.center().x());
}

// Arabic letters have other shapes within a word than alone, and lam with alef is one glyph.
TEST(Typeface, joinsArabicLetters) {
  Typeface typeface;
  const double alone = 3 * area(typeface.block(U"\u0628", 1));  // beh
  const double joined = area(typeface.block(U"\u0628\u0628\u0628", 1));
  EXPECT_GT(std::abs(alone - joined), 0.05);
  const auto width = [&](const std::u32string& text) {
    const auto bounds = box(typeface.block(text, 1));
    return bounds.max().x() - bounds.min().x();
  };
  EXPECT_LT(width(U"\u0644\u0627"), 0.9 * (width(U"\u0644") + width(U"\u0627")));
}

TEST(Typeface, takesFromAnotherFontWhatItsOwnLacks) {
  FcPattern* pattern = FcNameParse(reinterpret_cast<const FcChar8*>("DejaVu Serif:style=Book"));
  FcConfigSubstitute(nullptr, pattern, FcMatchPattern);
  FcDefaultSubstitute(pattern);
  FcResult result;
  FcPattern* found = FcFontMatch(nullptr, pattern, &result);
  FcChar8* file = nullptr;
  ASSERT_EQ(FcPatternGetString(found, FC_FILE, 0, &file), FcResultMatch);
  Typeface serif(reinterpret_cast<const char*>(file)), sans;
  FcPatternDestroy(found);
  FcPatternDestroy(pattern);
  const TextBlock beh = serif.set(U"\u0628", 1);  // fonts-dejavu-core: in Sans, not in Serif
  EXPECT_TRUE(beh.missing.empty());
  EXPECT_NEAR(area(beh.letters), area(sans.block(U"\u0628", 1)), 0.05);
  EXPECT_GT(std::abs(area(serif.block(U"H", 1)) - area(sans.block(U"H", 1))), 0.01)
      << "its own letters come from itself";
}

TEST(Typeface, saysWhichFontIsNone) {
  try {
    Typeface("/nowhere/font.ttf");
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "/nowhere/font.ttf: no font with outlines");
  }
}

TEST(Utf8, decodesAndReplacesWhatIsNone) {
  EXPECT_EQ(decodeUtf8("a\xc3\xa4\xe2\x82\xac\xf0\x9f\xa4\x96"), U"a\u00e4\u20ac\U0001F916");
  const std::u32string bad = {kReplacement};
  EXPECT_EQ(decodeUtf8("\x80"), bad);
  EXPECT_EQ(decodeUtf8("\xff"
                       "a"),
            bad + U"a");
  EXPECT_EQ(decodeUtf8("\xc3"), bad);  // cut off
  EXPECT_EQ(decodeUtf8("\xc3"
                       "a"),
            bad + U"a");
  EXPECT_EQ(decodeUtf8("\xc0\xaf"), bad + bad);  // overlong
  EXPECT_EQ(decodeUtf8("\xe0\x80\xaf"), bad + bad + bad);
  EXPECT_EQ(decodeUtf8("\xed\xa0\x80"), bad + bad + bad);  // a surrogate
  EXPECT_EQ(decodeUtf8("\xf4\x90\x80\x80").size(), 4u);    // beyond Unicode
  EXPECT_EQ(decodeUtf8(std::string("a\0b", 3)).size(), 3u);
}

}  // namespace
}  // namespace afterglow::render::typeface_test
