#include "calib/gray_code/chessboard.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <opencv2/calib3d.hpp>
#include <stdexcept>

namespace afterglow::calib {
namespace {

/// The error that OpenCV's sector-based search leaves, px; the solver measures it anew.
constexpr double kCornerSigma_px = 0.05;

/// Corners by fours: squares of the grid; of an odd last column or row, runs.
std::vector<std::array<std::size_t, 4>> groupsOfFour(const Chessboard& chessboard) {
  const auto columns = std::size_t(chessboard.columns), rows = std::size_t(chessboard.rows);
  std::vector<std::array<std::size_t, 4>> groups;
  for (std::size_t row = 0; row + 1 < rows; row += 2) {
    for (std::size_t column = 0; column + 1 < columns; column += 2) {
      const std::size_t at = row * columns + column;
      groups.push_back({at, at + 1, at + columns + 1, at + columns});
    }
  }
  std::vector<std::size_t> left;
  for (std::size_t row = 0; columns % 2 == 1 && row < rows; ++row) {
    left.push_back(row * columns + columns - 1);
  }
  for (std::size_t column = 0; rows % 2 == 1 && column < columns - columns % 2; ++column) {
    left.push_back((rows - 1) * columns + column);
  }
  for (std::size_t i = 0; i + 3 < left.size(); i += 4) {
    groups.push_back({left[i], left[i + 1], left[i + 2], left[i + 3]});
  }
  return groups;
}

/// Turned so that columns go right and rows down in the photograph, as far as they do.
void setUpright(std::vector<Eigen::Vector2d>& corners, const Chessboard& chessboard) {
  const auto columns = std::ptrdiff_t(chessboard.columns);
  const Eigen::Vector2d right = corners[std::size_t(columns) - 1] - corners.front();
  const Eigen::Vector2d down = corners[corners.size() - std::size_t(columns)] - corners.front();
  if (right.x() * down.y() - right.y() * down.x() < 0) {
    for (auto row = corners.begin(); row != corners.end(); row += columns) {
      std::reverse(row, row + columns);
    }
  }
  const Eigen::Vector2d now = corners[std::size_t(columns) - 1] - corners.front();
  if (now.x() + now.y() < 0) std::reverse(corners.begin(), corners.end());
}

}  // namespace

Eigen::Vector2d Chessboard::place(std::size_t corner) const {
  const auto column = double(corner % std::size_t(columns));
  const auto row = double(corner / std::size_t(columns));
  return square_m * Eigen::Vector2d(column - 0.5 * (columns - 1), 0.5 * (rows - 1) - row);
}

Board Chessboard::board() const {
  Board board;
  board.size_m = square_m * Eigen::Vector2d(columns + 1, rows + 1);
  for (const auto& group : groupsOfFour(*this)) {
    Tag tag;
    tag.id = static_cast<int>(board.tags.size());
    for (std::size_t i = 0; i < 4; ++i) tag.corners[i] = place(group[i]);
    board.tags.push_back(tag);
  }
  return board;
}

std::vector<SeenTag> Chessboard::tags(const std::vector<Eigen::Vector2d>& corners_px) const {
  std::vector<SeenTag> tags;
  for (const auto& group : groupsOfFour(*this)) {
    SeenTag tag;
    tag.id = static_cast<int>(tags.size());
    for (std::size_t i = 0; i < 4; ++i) tag.corners[i] = corners_px[group[i]];
    tag.covariance.setIdentity();
    tag.covariance *= kCornerSigma_px * kCornerSigma_px;
    tags.push_back(tag);
  }
  return tags;
}

std::optional<std::vector<Eigen::Vector2d>> findCorners(const Picture& picture,
                                                        const Chessboard& chessboard) {
  const cv::Mat image(picture.height, picture.width, CV_8UC1,
                      const_cast<std::uint8_t*>(picture.pixels.data()));  // NOLINT: only read
  std::vector<cv::Point2f> found;
  if (!cv::findChessboardCornersSB(image, {chessboard.columns, chessboard.rows}, found,
                                   cv::CALIB_CB_EXHAUSTIVE | cv::CALIB_CB_ACCURACY) ||
      found.size() != chessboard.corners()) {
    return std::nullopt;
  }
  std::vector<Eigen::Vector2d> corners;
  for (const cv::Point2f& one : found) corners.emplace_back(one.x, one.y);
  setUpright(corners, chessboard);
  return corners;
}

Lens cameraFromChessboards(const std::vector<std::vector<Eigen::Vector2d>>& corners_px,
                           const Chessboard& chessboard, int width, int height) {
  constexpr std::size_t kFewestViews = 3;
  if (corners_px.size() < kFewestViews) {
    throw std::invalid_argument(
        fmt::format("the chessboard was found in {} pictures: at least {} are needed to find the "
                    "camera's lens; give it with --camera",
                    corners_px.size(), kFewestViews));
  }
  std::vector<std::vector<cv::Point3f>> places(corners_px.size());
  std::vector<std::vector<cv::Point2f>> seen(corners_px.size());
  for (std::size_t view = 0; view < corners_px.size(); ++view) {
    for (std::size_t i = 0; i < corners_px[view].size(); ++i) {
      const Eigen::Vector2f place = chessboard.place(i).cast<float>();
      const Eigen::Vector2f pixel = corners_px[view][i].cast<float>();
      places[view].emplace_back(place.x(), -place.y(), 0.0F);  // OpenCV's board: y down
      seen[view].emplace_back(pixel.x(), pixel.y());
    }
  }
  cv::Matx33d K = cv::Matx33d::eye();
  cv::Mat D;
  std::vector<cv::Mat> turns, shifts;
  cv::calibrateCamera(places, seen, {width, height}, K, D, turns, shifts, cv::CALIB_FIX_K3);
  Eigen::Matrix3d lens_K;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) lens_K(row, column) = K(row, column);
  }
  try {
    return makeLens(width, height, lens_K, {D.begin<double>(), D.end<double>()});
  } catch (const std::invalid_argument&) {
    throw std::invalid_argument("the chessboards leave the camera's lens open: give it with "
                                "--camera, or take more views, tilted by 20 to 40 deg");
  }
}

}  // namespace afterglow::calib
