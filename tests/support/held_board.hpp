/// \file
/// A small board held before a camera, as the live calibration sees it, without a picture.
#pragma once

#include <vector>

#include "calib/guide/view_taker.hpp"
#include "calib/lens.hpp"
#include "calib/targets/board.hpp"
#include "calib/targets/pattern.hpp"

namespace afterglow::test {

using calib::Board;
using calib::kFirstPatternId;
using calib::Lens;
using calib::makeLens;
using calib::Pattern;
using calib::Tag;
using calib::WatchedImage;
using Pose = Rigid<Camera, Surface>;

constexpr std::int64_t kImage_ns = 100'000'000;  // ten images a second

inline Tag square(int id, double x, double y, double side) {
  return {id, {{{x, y}, {x + side, y}, {x + side, y - side}, {x, y - side}}}};
}

inline Board smallBoard() {
  Board board;
  board.size_m = {0.6, 0.4};
  int id = 0;
  for (const double x : {-0.29, -0.05, 0.21}) {
    for (const double y : {0.19, -0.11}) board.tags.push_back(square(id++, x, y, 0.08));
  }
  return board;
}

inline Pattern smallPattern() {
  Pattern pattern;
  pattern.width = 1280;
  pattern.height = 800;
  int id = kFirstPatternId;
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 12; ++x) {
      Tag tag;
      tag.id = id++;
      const double left = 20 + 105 * x, top = 20 + 97 * y, side = 64;
      tag.corners = {
          {{left, top}, {left + side, top}, {left + side, top + side}, {left, top + side}}};
      pattern.tags.push_back(tag);
    }
  }
  return pattern;
}

inline Lens camera() {
  Eigen::Matrix3d K = Eigen::Matrix3d::Identity();
  K(0, 0) = K(1, 1) = 700;
  K(0, 2) = 322;
  K(1, 2) = 238;
  return makeLens(640, 480, K, {-0.1, 0.05, 0.001, -0.001, 0});
}

/// Facing the camera, then tilted about the camera's axes; meters, radians.
inline Pose pose(double x, double y, double z, double about_x = 0, double about_y = 0) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() << x, y, z;
  T.linear() = (Eigen::AngleAxisd(about_y, Eigen::Vector3d::UnitY()) *
                Eigen::AngleAxisd(about_x, Eigen::Vector3d::UnitX()) *
                Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()))
                   .toRotationMatrix();
  return Pose(T);
}

inline std::vector<Tag> seen(const Pose& T_camera_board) {
  const Board board = smallBoard();
  const Lens lens = camera();
  std::vector<Tag> tags;
  for (const Tag& printed : board.tags) {
    Tag tag = printed;
    for (Eigen::Vector2d& corner : tag.corners) {
      corner = *project(lens, T_camera_board * Eigen::Vector3d(corner.x(), corner.y(), 0));
    }
    tags.push_back(tag);
  }
  return tags;
}

inline WatchedImage image(int number, const Pose& T_camera_board, int pattern_tags = 0) {
  WatchedImage made;
  made.stamp_ns = 1'000'000'000'000 + number * kImage_ns;
  made.board = seen(T_camera_board);
  made.pattern_tags = pattern_tags;
  made.mean_level = pattern_tags > 0 ? 90 : 110;
  return made;
}

}  // namespace afterglow::test
