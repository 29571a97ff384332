#include "calib/guide/advice.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace afterglow::calib {
namespace {

using Poses = std::vector<Rigid<Camera, Surface>>;

constexpr double kTilted = 0.21;      // rad, 12 degrees: what one view in each direction has
constexpr double kParallel = 0.26;    // rad, 15 degrees
constexpr double kDepthRange = 1.25;  // farthest to nearest board
constexpr double kCovered = 0.35;     // of a ninth of the picture
constexpr int kNinths = 3;

double distance(const Rigid<Camera, Surface>& pose) { return pose.matrix().translation().norm(); }

std::vector<std::string> missingTilts(const Poses& taken) {
  struct Direction {
    const char* name;
    Eigen::Vector2d axis;
  };
  const std::array<Direction, 4> directions = {{{"to the left", {-1, 0}},
                                                {"to the right", {1, 0}},
                                                {"upwards", {0, -1}},
                                                {"downwards", {0, 1}}}};
  std::vector<std::string> missing;
  for (const Direction& direction : directions) {
    const bool is_there = std::any_of(taken.begin(), taken.end(), [&](const auto& pose) {
      return boardTilt(pose).dot(direction.axis) > kTilted;
    });
    if (!is_there) missing.push_back(std::string("tilt it more ") + direction.name);
  }
  return missing;
}

std::string ninthText(int row, int column) {
  if (row == 1 && column == 1) return "hold it in the middle of the light";
  static const char* const kRows[] = {"further up", "", "further down"};
  static const char* const kColumns[] = {" on the left of the light", " in the light",
                                         " on the right of the light"};
  const std::string height = row == 1 ? "further out" : kRows[row];
  return "hold it " + height + kColumns[column];
}

/// The emptiest first.
std::vector<std::string> missingPlaces(const Coverage& coverage) {
  struct Ninth {
    int row, column;
    double share;
  };
  std::vector<Ninth> ninths;
  for (int row = 0; row < kNinths; ++row) {
    for (int column = 0; column < kNinths; ++column) {
      int lit = 0, all = 0;
      for (int y = row * Coverage::kRows / kNinths; y < (row + 1) * Coverage::kRows / kNinths;
           ++y) {
        for (int x = column * Coverage::kColumns / kNinths;
             x < (column + 1) * Coverage::kColumns / kNinths; ++x) {
          ++all;
          lit += coverage.corners[static_cast<std::size_t>(y * Coverage::kColumns + x)] > 0;
        }
      }
      const double share = static_cast<double>(lit) / all;
      if (share < kCovered) ninths.push_back({row, column, share});
    }
  }
  std::stable_sort(ninths.begin(), ninths.end(),
                   [](const Ninth& a, const Ninth& b) { return a.share < b.share; });
  std::vector<std::string> texts;
  for (const Ninth& ninth : ninths) texts.push_back(ninthText(ninth.row, ninth.column));
  return texts;
}

/// The shorter way from the board's present distance, in steps that a person can follow.
std::vector<std::string> missingDepth(const Poses& taken,
                                      const std::optional<Rigid<Camera, Surface>>& now) {
  if (taken.empty()) return {};
  const auto closer = [](const auto& a, const auto& b) { return distance(a) < distance(b); };
  const auto [nearest, farthest] = std::minmax_element(taken.begin(), taken.end(), closer);
  if (distance(*farthest) >= kDepthRange * distance(*nearest)) return {};
  const double here = distance(now ? *now : taken.back());
  const double to_near = here - distance(*farthest) / kDepthRange;
  const double to_far = kDepthRange * distance(*nearest) - here;
  const bool comes_closer = to_near <= to_far;
  const double way = std::max(0.0, comes_closer ? to_near : to_far);
  const long centimeters = std::max(10L, 10 * std::lround(std::ceil(way * 10)));
  return {comes_closer ? "come " + std::to_string(centimeters) + " cm closer"
                       : "go " + std::to_string(centimeters) + " cm further back"};
}

}  // namespace

Eigen::Vector2d boardTilt(const Rigid<Camera, Surface>& T_camera_board) {
  const Eigen::Vector3d normal = T_camera_board.matrix().linear().col(2);
  const Eigen::Vector3d to_camera = -T_camera_board.matrix().translation().normalized();
  const Eigen::Vector3d right = (Eigen::Vector3d::UnitX() - to_camera.x() * to_camera).normalized();
  const Eigen::Vector3d down = right.cross(to_camera);
  const auto angle = [](double sine) { return std::asin(std::clamp(sine, -1.0, 1.0)); };
  return {angle(normal.dot(right)), angle(normal.dot(down))};
}

bool areParallel(const Poses& taken) {
  for (std::size_t i = 0; i < taken.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const double cosine =
          taken[i].matrix().linear().col(2).dot(taken[j].matrix().linear().col(2));
      if (std::acos(std::clamp(cosine, -1.0, 1.0)) > kParallel) return false;
    }
  }
  return true;
}

std::vector<std::string> adviceFor(const Poses& taken, const Coverage& coverage,
                                   const std::optional<Rigid<Camera, Surface>>& now) {
  if (taken.empty()) return {"hold the board in the light, where the camera sees all of it"};
  std::vector<std::string> all;
  if (taken.size() >= 2 && areParallel(taken)) {
    all.push_back("turn it: all boards were parallel so far");
  }
  const std::vector<std::string> tilts = missingTilts(taken), places = missingPlaces(coverage);
  const std::vector<std::string> depth = missingDepth(taken, now);
  // In turns, so that advice that cannot be followed does not hide the other advice.
  for (std::size_t i = 0; i < std::max({tilts.size(), places.size(), depth.size()}); ++i) {
    for (const auto* list : {&tilts, &places, &depth}) {
      if (i < list->size()) all.push_back((*list)[i]);
    }
  }
  return all;
}

}  // namespace afterglow::calib
