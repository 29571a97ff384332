#include "nodes/tools/tag_layout_file.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "calib/targets/board.hpp"
#include "calib/targets/tag.hpp"
#include "nodes/tools/yaml_map.hpp"

namespace afterglow::nodes {
namespace {

constexpr double kFarthest_m = 100, kLeastSize_m = 0.005, kGreatestSize_m = 10;

/// Reads one file into one TagLayout.
class LayoutFile {
 public:
  explicit LayoutFile(std::string file) : file_(std::move(file)) {}

  calib::TagLayout read() {
    // The last three belong to boards, of which only the tags' places matter here.
    const YamlMap root(file_, loadYaml(file_), "the tag layout",
                       {"family", "frame", "tags", "targets", "size_m", "ruler_m", "picture"});
    if (root.has("family")) {
      layout_.family = calib::kTagFamilies[root.choice("family", calib::kTagFamilies)];
    }
    if (root.has("frame")) layout_.frame = root.text("frame");
    count_ = calib::tagCount(layout_.family);
    readTags(root, "tags", layout_.tags);
    if (root.has("targets")) readTags(root, "targets", layout_.targets);
    return std::move(layout_);
  }

 private:
  void readTags(const YamlMap& root, const std::string& key, std::vector<calib::Tag>& tags) {
    const YAML::Node list = root.at(key);
    if (!list.IsSequence() || list.size() == 0) {
      root.fail(list, "'" + key + "' should be a list of at least one tag");
    }
    for (std::size_t i = 0; i < list.size(); ++i) {
      const YamlMap map(file_, list[i], "entry " + std::to_string(i + 1) + " of '" + key + "'",
                        {"id", "center", "size", "yaw_deg", "corners"});
      const calib::Tag tag = readTag(map);
      checkId(map, tag.id, key);
      checkRoom(map, tag);
      tags.push_back(tag);
    }
  }

  calib::Tag readTag(const YamlMap& map) const {
    const double number = map.number("id", 0, count_ - 1);
    if (number != std::floor(number)) map.fail(map.at("id"), "'id' should be a whole number");
    const int id = static_cast<int>(number);
    if (map.has("corners") == map.has("center")) {
      map.fail(map.node(), map.where() + " needs either 'center' and 'size' or 'corners'");
    }
    if (map.has("corners")) return readCorners(map, id);
    const auto center = map.numbers(map.at("center"), "'center' of " + map.where(), 2);
    const double size = map.number("size", kLeastSize_m, kGreatestSize_m);
    const double yaw_deg = map.number("yaw_deg", -360, 360, 0);
    const calib::Tag tag = calib::squareTag(id, {center[0], center[1]}, size, yaw_deg * M_PI / 180);
    requireNear(map, tag);
    return tag;
  }

  static calib::Tag readCorners(const YamlMap& map, int id) {
    for (const char* key : {"size", "yaw_deg"}) {
      if (map.has(key))
        map.fail(map.at(key), "'corners' say all, without '" + std::string(key) + "'");
    }
    const YAML::Node list = map.at("corners");
    const std::string what = "'corners' of " + map.where();
    if (!list.IsSequence() || list.size() != 4) map.fail(list, what + " should be four [x, y]");
    calib::Tag tag;
    tag.id = id;
    for (std::size_t i = 0; i < 4; ++i) {
      const bool has_z = list[i].IsSequence() && list[i].size() == 3;
      const auto p = map.numbers(list[i], "a corner of " + map.where(), has_z ? 3 : 2);
      if (has_z && p[2] != 0) map.fail(list[i], what + ": z should be 0, the surface's plane");
      tag.corners[i] = Eigen::Vector2d(p[0], p[1]);
    }
    requireNear(map, tag);
    requireSquare(map, tag);
    return tag;
  }

  static void requireNear(const YamlMap& map, const calib::Tag& tag) {
    const bool is_near = std::all_of(tag.corners.begin(), tag.corners.end(), [](const auto& p) {
      return (p.array().abs() < kFarthest_m).all();
    });
    if (!is_near) map.fail(map.node(), map.where() + " is over 100 m away: places are in meters");
  }

  static void requireSquare(const YamlMap& map, const calib::Tag& tag) {
    const Eigen::Vector2d right = tag.corners[1] - tag.corners[0];
    const Eigen::Vector2d down = tag.corners[3] - tag.corners[0];
    const Eigen::Vector2d rest = tag.corners[2] - tag.corners[1] - down;
    // The error of measuring by hand.
    const double tolerance = 0.05 * right.norm();
    const bool is_square = right.norm() > kLeastSize_m && rest.norm() < tolerance &&
                           std::abs(down.norm() - right.norm()) < tolerance &&
                           std::abs(right.dot(down)) < tolerance * right.norm();
    const bool is_face_up = right.x() * down.y() - right.y() * down.x() < 0;
    if (!is_square || !is_face_up) {
      map.fail(map.at("corners"), "'corners' of " + map.where() +
                                      " should be a square: top left, top right, bottom right, "
                                      "bottom left, y up, meters");
    }
  }

  void checkId(const YamlMap& map, int id, const std::string& key) const {
    if (key == "targets" && id < calib::kFirstPatternId) {
      map.fail(map.at("id"), "target " + std::to_string(id) + ": ids of thrown tags are from " +
                                 std::to_string(calib::kFirstPatternId) + " on");
    }
    for (const auto* tags : {&layout_.tags, &layout_.targets}) {
      for (const calib::Tag& other : *tags) {
        if (other.id == id) map.fail(map.at("id"), "id " + std::to_string(id) + " twice");
      }
    }
  }

  void checkRoom(const YamlMap& map, const calib::Tag& tag) const {
    for (const auto* tags : {&layout_.tags, &layout_.targets}) {
      for (const calib::Tag& other : *tags) {
        if (!calib::areTooClose(tag, other)) continue;
        map.fail(map.node(), "tags " + std::to_string(tag.id) + " and " + std::to_string(other.id) +
                                 " overlap: each needs a white rim of an eighth of its size");
      }
    }
  }

  std::string file_;
  int count_ = 0;
  calib::TagLayout layout_;
};

}  // namespace

calib::TagLayout loadTagLayout(const std::string& path) { return LayoutFile(path).read(); }

}  // namespace afterglow::nodes
