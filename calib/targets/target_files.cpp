#include "calib/targets/target_files.hpp"

#include <cairo-pdf.h>
#include <cairo.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <memory>
#include <stdexcept>

#include "calib/file_replacement.hpp"
#include "calib/number_text.hpp"
#include "calib/picture.hpp"
#include "calib/targets/pattern.hpp"
#include "calib/targets/tag.hpp"
#include "calib/yaml_source.hpp"

namespace afterglow::calib {
namespace {

/// Rounded to the nanometer: 0.0365, not 0.036500000000000005; 0, not -0.
std::string numberText(double value) { return exactText(std::round(value * 1e9) / 1e9 + 0.0); }

/// `z`: what follows the two coordinates of a corner.
std::string tagsText(const std::vector<Tag>& tags, const std::string& z) {
  std::string text = "tags:\n";
  for (const Tag& tag : tags) {
    text += "  - {id: " + std::to_string(tag.id) + ", corners: [";
    for (const Eigen::Vector2d& corner : tag.corners) {
      text += (&corner == &tag.corners.front() ? "[" : ", [") + numberText(corner.x()) + ", " +
              numberText(corner.y()) + z + "]";
    }
    text += "]}\n";
  }
  return text;
}

std::string boardText(const Board& board) {
  return "# Meters; origin in the board's middle, x right, y up, z out of the paper. Corners of "
         "each black\n# square: top left, top right, bottom right, bottom left. ruler_m is the "
         "printed ruler's length.\nfamily: " +
         board.family + "\nsize_m: [" + numberText(board.size_m.x()) + ", " +
         numberText(board.size_m.y()) + "]\nruler_m: " + numberText(board.ruler_m) +
         "\npicture: board.png\n" + tagsText(board.tags, ", 0");
}

std::string patternText(const Pattern& pattern) {
  return "# Pixels; the center of the top-left pixel is (0, 0), y down. Corners of each black "
         "square: top\n# left, top right, bottom right, bottom left.\nfamily: " +
         pattern.family + "\nwidth: " + std::to_string(pattern.width) +
         "\nheight: " + std::to_string(pattern.height) + "\npicture: pattern.png\n" +
         tagsText(pattern.tags, "");
}

/// No sheet is larger (makeBoard), and no number in millimeters on a usable one is smaller.
constexpr double kLargestSheet_m = 5;
/// The distance of a tag from square, as a share of its side: room for coordinates that somebody
/// rounded.
constexpr double kSquareTolerance = 0.02;

std::string readFamily(const YamlSource& source, const std::string& where) {
  const YAML::Node node = source.at(source.root(), "family", where);
  const std::string family = source.text(node, "'family'");
  try {
    tagCount(family);
  } catch (const std::invalid_argument& error) {
    source.refuse(node, error.what());
  }
  return family;
}

/// The differences between the tags of a board and those of a pattern.
struct TagRules {
  std::string where;  ///< "a board"
  std::string family;
  int first_id = 0, end_id = 0;
  std::string id_advice;
  std::size_t numbers = 2;  ///< a corner
  double y_down = 1;        ///< -1 where y is up
  Eigen::Vector2d low, high;
  std::string place;  ///< the name of the range from `low` to `high`
  /// Returns why a corner's numbers are impossible, or empty.
  std::function<std::string(const std::vector<double>&)> objection;
};

class TagReader {
 public:
  TagReader(const YamlSource& source, const TagRules& rules) : source_(source), rules_(rules) {}

  std::vector<Tag> read() const {
    const YAML::Node list = source_.at(source_.root(), "tags", rules_.where);
    if (!list.IsSequence() || list.size() == 0) {
      source_.refuse(list, "'tags' should be a list of {id, corners}");
    }
    std::vector<Tag> tags;
    for (const YAML::Node& node : list) {
      const Tag tag = readTag(node);
      for (const Tag& other : tags) compare(node, tag, other);
      tags.push_back(tag);
    }
    return tags;
  }

 private:
  Tag readTag(const YAML::Node& node) const {
    source_.requireKeys(node, "a tag", {"id", "corners"});
    Tag tag;
    const YAML::Node id = source_.at(node, "id", "a tag");
    tag.id = source_.integer(id, "'id'");
    requireId(id, tag.id);
    const std::string name = fmt::format("tag {}", tag.id);
    const YAML::Node corners = source_.at(node, "corners", name);
    if (!corners.IsSequence() || corners.size() != 4) {
      source_.refuse(corners, "'corners' of " + name + " should be four: top left, top right, " +
                                  "bottom right, bottom left");
    }
    for (std::size_t i = 0; i < 4; ++i) tag.corners[i] = readCorner(corners[i], name);
    requireSquare(corners, tag);
    return tag;
  }

  void requireId(const YAML::Node& node, int id) const {
    const int count = tagCount(rules_.family);
    if (id < 0 || id >= count) {
      source_.refuse(node, fmt::format("{} has no tag {}: its ids are 0 to {}", rules_.family, id,
                                       count - 1));
    }
    if (id < rules_.first_id || id >= rules_.end_id) {
      source_.refuse(node, fmt::format("tag {} on {}: {}", id, rules_.where, rules_.id_advice));
    }
  }

  Eigen::Vector2d readCorner(const YAML::Node& node, const std::string& name) const {
    const std::vector<double> values = source_.numbers(node, "a corner of " + name, rules_.numbers);
    const std::string objection = rules_.objection(values);
    if (!objection.empty()) source_.refuse(node, "a corner of " + name + " " + objection);
    const Eigen::Vector2d corner(values[0], values[1]);
    const double tolerance = 1e-6 * (rules_.high - rules_.low).maxCoeff();
    if (((corner - rules_.low).array() < -tolerance).any() ||
        ((corner - rules_.high).array() > tolerance).any()) {
      source_.refuse(
          node, fmt::format("a corner of {} lies outside {}, which goes from ({:g}, {:g}) to "
                            "({:g}, {:g})",
                            name, rules_.place, rules_.low.x(), rules_.low.y(), rules_.high.x(),
                            rules_.high.y()));
    }
    return corner;
  }

  void requireSquare(const YAML::Node& node, const Tag& tag) const {
    const auto& c = tag.corners;
    const Eigen::Vector2d right = c[1] - c[0];
    const Eigen::Vector2d down = rules_.y_down * Eigen::Vector2d(-right.y(), right.x());
    const double tolerance = kSquareTolerance * right.norm();
    const auto fits = [&](const Eigen::Vector2d& side) {
      return (c[3] - c[0] - side).norm() <= tolerance && (c[2] - c[1] - side).norm() <= tolerance;
    };
    if (right.norm() > 0 && fits(-down)) {
      source_.refuse(node, fmt::format("tag {} is mirrored: expected its corners as top left, top "
                                       "right, bottom right, bottom left",
                                       tag.id));
    }
    if (!(right.norm() > 0) || !fits(down)) {
      source_.refuse(node, fmt::format("the corners of tag {} are no square", tag.id));
    }
  }

  /// Tags of one size apart by less than their side overlap; of two sizes, by less than the mean.
  void compare(const YAML::Node& node, const Tag& tag, const Tag& other) const {
    if (tag.id == other.id) source_.refuse(node, fmt::format("tag {} twice", tag.id));
    const auto side = [](const Tag& t) { return (t.corners[1] - t.corners[0]).norm(); };
    const auto middle = [](const Tag& t) -> Eigen::Vector2d {
      return (t.corners[0] + t.corners[2]) / 2;
    };
    if ((middle(tag) - middle(other)).norm() < 0.99 * (side(tag) + side(other)) / 2) {
      source_.refuse(node, fmt::format("tags {} and {} overlap", other.id, tag.id));
    }
  }

  const YamlSource& source_;
  const TagRules& rules_;
};

Eigen::Vector2d readSheet(const YamlSource& source) {
  const YAML::Node node = source.at(source.root(), "size_m", "a board");
  const std::vector<double> size = source.numbers(node, "'size_m'", 2);
  const double largest = std::max(size[0], size[1]);
  if (largest > kLargestSheet_m) {
    source.refuse(node, fmt::format("'size_m' is {:g} x {:g}, which looks like millimeters: in "
                                    "meters that is [{:g}, {:g}]",
                                    size[0], size[1], size[0] / 1e3, size[1] / 1e3));
  }
  if (!(std::min(size[0], size[1]) > 0)) {
    source.refuse(node, fmt::format("'size_m' is {:g} x {:g}: expected two sides above 0", size[0],
                                    size[1]));
  }
  return {size[0], size[1]};
}

double readRuler(const YamlSource& source, double longest_m) {
  const YAML::Node node = source.root()["ruler_m"];
  if (!node.IsDefined()) return 0;
  const double ruler = source.number(node, "'ruler_m'");
  if (ruler > kLargestSheet_m) {
    source.refuse(node, fmt::format("'ruler_m' is {:g}, which looks like millimeters: in meters "
                                    "that is {:g}",
                                    ruler, ruler / 1e3));
  }
  if (!(ruler >= 0 && ruler <= longest_m)) {
    source.refuse(node, fmt::format("'ruler_m' is {:g}: expected 0 (none) to {:g}, the sheet's "
                                    "longer side",
                                    ruler, longest_m));
  }
  return ruler;
}

std::string boardCornerObjection(const std::vector<double>& corner) {
  if (std::max(std::abs(corner[0]), std::abs(corner[1])) > kLargestSheet_m) {
    return fmt::format(
        "is ({:g}, {:g}), which looks like millimeters: corners are in meters", corner[0],
        corner[1]);
  }
  return corner[2] == 0 ? "" : fmt::format("has z {:g}: on a board z is 0", corner[2]);
}

/// The picture's name is only for other programs, but it must be a file's name.
void requirePictureName(const YamlSource& source) {
  const YAML::Node node = source.root()["picture"];
  if (node.IsDefined()) source.text(node, "'picture'");
}

int readSide(const YamlSource& source, const std::string& key) {
  const YAML::Node node = source.at(source.root(), key, "a pattern");
  const int side = source.integer(node, "'" + key + "'");
  if (side < 1 || side > 65535) {
    source.refuse(node, fmt::format("'{}' is {}: expected a projector's pixels", key, side));
  }
  return side;
}

}  // namespace

void writeBoard(const std::string& folder, const Board& board) {
  const std::filesystem::path path(folder);
  FileReplacement files;
  files.add((path / "board.pdf").string(), boardPdf(board));
  files.add((path / "board.png").string(), boardPng(board));
  files.add((path / "board.yaml").string(), boardText(board));
  files.commit();
}

void writePattern(const std::string& folder, const Pattern& pattern) {
  const std::filesystem::path path(folder);
  FileReplacement files;
  files.add((path / "pattern.png").string(), patternPng(pattern));
  files.add((path / "pattern.yaml").string(), patternText(pattern));
  files.commit();
}

Board loadBoard(const std::string& yaml_path) {
  const YamlSource source(yaml_path);
  source.requireKeys(source.root(), "a board", {"family", "size_m", "ruler_m", "picture", "tags"});
  Board board;
  board.family = readFamily(source, "a board");
  board.size_m = readSheet(source);
  board.ruler_m = readRuler(source, board.size_m.maxCoeff());
  requirePictureName(source);
  TagRules rules;
  rules.where = "a board";
  rules.family = board.family;
  rules.end_id = kFirstPatternId;
  rules.id_advice = fmt::format("ids from {} on are the projected pattern's", kFirstPatternId);
  rules.numbers = 3;
  rules.y_down = -1;
  rules.low = -board.size_m / 2;
  rules.high = board.size_m / 2;
  rules.place = "the sheet";
  rules.objection = boardCornerObjection;
  board.tags = TagReader(source, rules).read();
  return board;
}

Pattern loadPattern(const std::string& yaml_path) {
  const YamlSource source(yaml_path);
  source.requireKeys(source.root(), "a pattern", {"family", "width", "height", "picture", "tags"});
  Pattern pattern;
  pattern.family = readFamily(source, "a pattern");
  pattern.width = readSide(source, "width");
  pattern.height = readSide(source, "height");
  requirePictureName(source);
  TagRules rules;
  rules.where = "a pattern";
  rules.family = pattern.family;
  rules.first_id = kFirstPatternId;
  rules.end_id = tagCount(pattern.family);
  rules.id_advice = fmt::format("ids below {} are the printed board's", kFirstPatternId);
  rules.low = Eigen::Vector2d::Constant(-0.5);
  rules.high = Eigen::Vector2d(pattern.width - 0.5, pattern.height - 0.5);
  rules.place = "the picture";
  rules.objection = [](const std::vector<double>&) { return std::string(); };
  pattern.tags = TagReader(source, rules).read();
  return pattern;
}

namespace {

constexpr double kPixelsPerMeter = 2000;
constexpr double kMostPixels = 4000;  ///< along a side of the picture
constexpr double kPointsPerMeter = 72 / 0.0254;

/// Everything but the tags, in mm.
constexpr double kLine = 0.2;
constexpr double kMillimeterTick = 1.8, kFiveTick = 3, kTenTick = 4.5;
constexpr double kGap = 1;
constexpr double kNumberFont = 2.6, kLargestFont = 4;
constexpr double kTextGray = 0.4;

using Surface = std::unique_ptr<cairo_surface_t, void (*)(cairo_surface_t*)>;

struct Point {
  double x, y;
};

/// Draws in millimeters, origin in the sheet's middle, y down.
class Pen {
 public:
  /// `scale`: the surface's units per meter.
  Pen(cairo_surface_t* surface, const Eigen::Vector2d& size_m, const Eigen::Vector2d& scale)
      : cairo_(cairo_create(surface), cairo_destroy) {
    cairo_scale(get(), scale.x() / 1000, scale.y() / 1000);
    cairo_translate(get(), size_m.x() * 500, size_m.y() * 500);
    cairo_select_font_face(get(), "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
    // The same gray letters at every resolution.
    cairo_font_options_t* options = cairo_font_options_create();
    cairo_font_options_set_hint_style(options, CAIRO_HINT_STYLE_NONE);
    cairo_font_options_set_hint_metrics(options, CAIRO_HINT_METRICS_OFF);
    cairo_font_options_set_antialias(options, CAIRO_ANTIALIAS_GRAY);
    cairo_set_font_options(get(), options);
    cairo_font_options_destroy(options);
    setGray(0);
  }

  void setGray(double gray) { cairo_set_source_rgb(get(), gray, gray, gray); }

  void line(Point from, Point to) {
    cairo_set_line_width(get(), kLine);
    cairo_move_to(get(), from.x, from.y);
    cairo_line_to(get(), to.x, to.y);
    cairo_stroke(get());
  }

  void triangle(Point a, Point b, Point c) {
    cairo_move_to(get(), a.x, a.y);
    cairo_line_to(get(), b.x, b.y);
    cairo_line_to(get(), c.x, c.y);
    cairo_close_path(get());
    cairo_fill(get());
  }

  double textWidth(const std::string& text, double font) {
    cairo_text_extents_t extents;
    cairo_set_font_size(get(), font);
    cairo_text_extents(get(), text.c_str(), &extents);
    return extents.width;
  }

  /// `anchor`: which part of the text's ink is at the point, (0, 0) its top left, (1, 1) its
  /// bottom right.
  void text(Point at, Point anchor, const std::string& text, double font) {
    cairo_text_extents_t extents;
    cairo_set_font_size(get(), font);
    cairo_text_extents(get(), text.c_str(), &extents);
    cairo_move_to(get(), at.x - extents.x_bearing - anchor.x * extents.width,
                  at.y - extents.y_bearing - anchor.y * extents.height);
    cairo_show_text(get(), text.c_str());
  }

  /// Draws one path for each tag: separate cells would leave hairlines between them.
  void tag(const Tag& tag, const TagCells& black) {
    const Eigen::Vector2d origin = tag.corners[0] * 1e3;
    const Eigen::Vector2d right = (tag.corners[1] - tag.corners[0]) * 1e3 / kTagCells;
    const Eigen::Vector2d down = (tag.corners[3] - tag.corners[0]) * 1e3 / kTagCells;
    cairo_save(get());
    const cairo_matrix_t cells{right.x(), -right.y(), down.x(), -down.y(), origin.x(), -origin.y()};
    cairo_transform(get(), &cells);
    for (int row = 0; row < kTagCells; ++row) addRuns(row, black[static_cast<std::size_t>(row)]);
    cairo_fill(get());
    cairo_restore(get());
  }

  /// Drawing calls never fail by themselves: cairo remembers the first error.
  void check() { throwUnlessFine(cairo_status(get())); }
  static void throwUnlessFine(cairo_status_t status) {
    if (status == CAIRO_STATUS_SUCCESS) return;
    throw std::runtime_error(std::string("the board cannot be drawn: ") +
                             cairo_status_to_string(status));
  }

 private:
  cairo_t* get() { return cairo_.get(); }

  void addRuns(int row, const std::array<bool, kTagCells>& black) {
    for (int begin = 0; begin < kTagCells;) {
      int end = begin;
      while (end < kTagCells && black[static_cast<std::size_t>(end)]) ++end;
      if (end > begin) {
        cairo_move_to(get(), begin, row);
        cairo_line_to(get(), end, row);
        cairo_line_to(get(), end, row + 1);
        cairo_line_to(get(), begin, row + 1);
        cairo_close_path(get());
      }
      begin = end + 1;
    }
  }

  std::unique_ptr<cairo_t, void (*)(cairo_t*)> cairo_;
};

/// The middle within the tags and their white rims, in the pen's mm.
struct Middle {
  double left, right, top, bottom;
  double font;  ///< font size of ids
};

Middle middleOf(const Board& board) {
  double side = 0;
  Eigen::Vector2d reach = Eigen::Vector2d::Zero();
  for (const Tag& tag : board.tags) {
    side = std::max(side, (tag.corners[1] - tag.corners[0]).norm());
    for (const Eigen::Vector2d& corner : tag.corners) reach = reach.cwiseMax(corner.cwiseAbs());
  }
  const double cell = side / kTagCells;
  const Eigen::Vector2d half = (reach.array() - side - cell) * 1e3;
  return {-half.x(), half.x(), -half.y(), half.y(), std::clamp(cell * 500, 1.6, kLargestFont)};
}

/// Beside its tag, where the tag's white rim ends and the free middle begins; a corner's tag is
/// pointed at, as its neighbors are as near.
void drawId(Pen& pen, const Middle& middle, const Tag& tag) {
  const Eigen::Vector2d center = (tag.corners[0] + tag.corners[2]) * 500;
  const Point at{std::clamp(center.x(), middle.left, middle.right),
                 std::clamp(-center.y(), middle.top, middle.bottom)};
  const auto anchor = [](double value, double low, double high) {
    return value <= low ? 0 : value >= high ? 1 : 0.5;
  };
  const Point side{anchor(at.x, middle.left, middle.right),
                   anchor(at.y, middle.top, middle.bottom)};
  Point text = at;
  if (side.x != 0.5 && side.y != 0.5) {
    const Point inward{(1 - 2 * side.x) * middle.font / 2, (1 - 2 * side.y) * middle.font / 2};
    pen.triangle(at, {at.x + inward.x, at.y}, {at.x, at.y + inward.y});
    text = {at.x + 0.7 * inward.x, at.y + 0.7 * inward.y};
  }
  pen.text(text, side, std::to_string(tag.id), middle.font);
}

std::string millimeters(double meters) { return exactText(std::round(meters * 1e4) / 10); }

/// The mark of the upper side, and the board's name.
void drawTitle(Pen& pen, const Middle& middle, const Board& board) {
  const double side = (board.tags.front().corners[1] - board.tags.front().corners[0]).norm();
  const std::string title = "this side up   " + board.family + ", sheet " +
                            millimeters(board.size_m.x()) + " x " + millimeters(board.size_m.y()) +
                            " mm, tags " + millimeters(side) + " mm";
  const double room = (middle.right - middle.left) * 0.9;
  const double font = std::min(middle.font * 0.8, room / pen.textWidth(title + " ^  ", 1));
  const double arrow = font, width = arrow * 1.4 + pen.textWidth(title, font);
  const double top = middle.top + middle.font + kGap, left = -width / 2;
  pen.triangle({left, top + arrow * 0.8}, {left + arrow, top + arrow * 0.8},
               {left + arrow / 2, top});
  pen.text({left + arrow * 1.4, top}, {0, 0}, title, font);
}

/// Ticks every millimeter, numbers every ten.
void drawScale(Pen& pen, double left, double base, int length_mm) {
  const double font = std::min(kNumberFont, length_mm / 25.0);  // room for those of a short ruler
  pen.line({left - kLine / 2, base}, {left + length_mm + kLine / 2, base});
  for (int mm = 0; mm <= length_mm; ++mm) {
    const double tick = mm % 10 == 0 ? kTenTick : mm % 5 == 0 ? kFiveTick : kMillimeterTick;
    pen.line({left + mm, base}, {left + mm, base - tick});
    if (mm % 10 == 0) {
      pen.text({left + mm, base - kTenTick - kGap / 2}, {0.5, 1}, std::to_string(mm), font);
    }
  }
}

/// The scale, and below it, between arrows that touch its ends, its purpose.
void drawRuler(Pen& pen, const Middle& middle, double ruler_m) {
  const int length_mm = static_cast<int>(std::lround(ruler_m * 1e3));
  const std::string caption =
      "print at 100 %, no scaling; this ruler must measure " + std::to_string(length_mm) + " mm";
  constexpr double kArrow = 3, kShaft = 4;
  const double left = -length_mm / 2.0, right = length_mm / 2.0;
  const double font =
      std::min(kLargestFont, (length_mm - 2 * (kArrow + kShaft)) / pen.textWidth(caption, 1));
  const double text_y = middle.bottom - middle.font - kGap - font / 2;
  const double base = text_y - std::max(font * 0.5, 1.0) - kGap;
  drawScale(pen, left, base, length_mm);
  for (const double end : {left, right}) {
    const double inward = end < 0 ? 1 : -1;
    pen.line({end, base}, {end, text_y + 1.5});
    pen.triangle({end, text_y}, {end + inward * kArrow, text_y - 1},
                 {end + inward * kArrow, text_y + 1});
    pen.line({end + inward * kArrow, text_y},
             {inward * -(pen.textWidth(caption, font) / 2 + kGap), text_y});
  }
  pen.text({0, text_y}, {0.5, 0.5}, caption, font);
}

void draw(cairo_surface_t* surface, const Board& board, const Eigen::Vector2d& scale) {
  Pen pen(surface, board.size_m, scale);
  for (const Tag& tag : board.tags) pen.tag(tag, tagCells(board.family, tag.id));
  if (!board.tags.empty()) {
    const Middle middle = middleOf(board);
    if (board.ruler_m > 0) drawRuler(pen, middle, board.ruler_m);
    pen.setGray(kTextGray);
    for (const Tag& tag : board.tags) drawId(pen, middle, tag);
    drawTitle(pen, middle, board);
  }
  pen.check();
}

cairo_status_t append(void* text, const unsigned char* bytes, unsigned count) {
  static_cast<std::string*>(text)->append(bytes, bytes + count);
  return CAIRO_STATUS_SUCCESS;
}

/// Returns a gray picture: the red of what was drawn in grays only.
Picture grayOf(cairo_surface_t* surface) {
  cairo_surface_flush(surface);
  Picture picture;
  picture.width = cairo_image_surface_get_width(surface);
  picture.height = cairo_image_surface_get_height(surface);
  const unsigned char* row = cairo_image_surface_get_data(surface);
  for (int y = 0; y < picture.height; ++y, row += cairo_image_surface_get_stride(surface)) {
    for (int x = 0; x < picture.width; ++x) picture.pixels.push_back(row[4 * x + 1]);
  }
  return picture;
}

Picture boardPicture(const Board& board) {
  const double pixels_per_m = std::min(kPixelsPerMeter, kMostPixels / board.size_m.maxCoeff());
  const Eigen::Vector2d pixels = (board.size_m * pixels_per_m).array().round().max(1);
  const Surface surface(cairo_image_surface_create(CAIRO_FORMAT_RGB24, static_cast<int>(pixels.x()),
                                                   static_cast<int>(pixels.y())),
                        cairo_surface_destroy);
  const std::unique_ptr<cairo_t, void (*)(cairo_t*)> paper(cairo_create(surface.get()),
                                                           cairo_destroy);
  cairo_set_source_rgb(paper.get(), 1, 1, 1);
  cairo_paint(paper.get());
  draw(surface.get(), board, pixels.cwiseQuotient(board.size_m));
  return grayOf(surface.get());
}

}  // namespace

std::string boardPdf(const Board& board) {
  std::string pdf;
  const Surface surface(
      cairo_pdf_surface_create_for_stream(append, &pdf, board.size_m.x() * kPointsPerMeter,
                                          board.size_m.y() * kPointsPerMeter),
      cairo_surface_destroy);
  cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_TITLE,
                                 "Calibration board: print at 100 %, no scaling");
  draw(surface.get(), board, Eigen::Vector2d::Constant(kPointsPerMeter));
  cairo_surface_finish(surface.get());
  Pen::throwUnlessFine(cairo_surface_status(surface.get()));
  return pdf;
}

std::string boardPng(const Board& board) { return encodePng(boardPicture(board), board.size_m); }

}  // namespace afterglow::calib
