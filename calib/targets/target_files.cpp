#include "calib/targets/target_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <stdexcept>

#include "calib/file_replacement.hpp"
#include "calib/number_text.hpp"
#include "calib/targets/board_drawing.hpp"
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

}  // namespace afterglow::calib
