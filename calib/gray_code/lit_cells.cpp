#include "calib/gray_code/lit_cells.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/calib3d.hpp>
#include <stdexcept>

#include "calib/median.hpp"

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

namespace {

/// The cells are this wide, in shares of the picture's width, and at least so many stripes.
constexpr int kCellsAcross = 24, kFewestStripes = 8;
/// Beyond the outermost corners the board's last squares still count, this much of them.
constexpr double kOuterShare = 0.9;
constexpr std::size_t kFewestPixels = 40;
/// Standard deviation of a cell's corner in stripes; cells that know less are left out.
constexpr double kLargestSigma = 0.12;
/// Pixels further off their cell's middle than this, in stripes, are misread.
constexpr double kLargestOff = 2.5;

int cellSize(const GrayCode& code) {
  const int stripes = kFewestStripes * std::max(code.across.step, code.down.step);
  return std::max({16, code.across.pixels / kCellsAcross, stripes});
}

/// Lower edge of a cell, projector px.
double edgeOf(int cell, int size) { return cell * size - 0.5; }

Eigen::Vector2d through(const Eigen::Matrix3d& H, const Eigen::Vector2d& p) {
  return (H * p.homogeneous()).hnormalized();
}

/// Empty matrix if there is none.
Eigen::Matrix3d homographyOf(const std::vector<cv::Point2d>& from,
                             const std::vector<cv::Point2d>& to, double tolerance) {
  cv::setRNGSeed(1);
  cv::Mat H;
  if (from.size() >= 4) H = cv::findHomography(from, to, cv::RANSAC, tolerance);
  Eigen::Matrix3d result = Eigen::Matrix3d::Constant(std::nan(""));
  for (int row = 0; row < H.rows; ++row) {
    for (int column = 0; column < H.cols; ++column) result(row, column) = H.at<double>(row, column);
  }
  return result;
}

struct LitPixel {
  Eigen::Vector2d camera_px, projector_px;
};

/// The lit pixels on the board; infinite ones are outside.
std::vector<LitPixel> pixelsOnBoard(const DecodedLight& light, const Chessboard& chessboard,
                                    const std::vector<Eigen::Vector2d>& corners_px) {
  std::vector<cv::Point2d> grid, seen;
  for (std::size_t i = 0; i < corners_px.size(); ++i) {
    grid.emplace_back(double(i % std::size_t(chessboard.columns)),
                      double(i / std::size_t(chessboard.columns)));
    seen.emplace_back(corners_px[i].x(), corners_px[i].y());
  }
  std::vector<LitPixel> pixels;
  const Eigen::Matrix3d grid_of_camera = homographyOf(seen, grid, 0.5);
  if (!grid_of_camera.allFinite()) return pixels;
  const Eigen::Vector2d low = Eigen::Vector2d::Constant(-kOuterShare);
  const Eigen::Vector2d high(chessboard.columns - 1 + kOuterShare,
                             chessboard.rows - 1 + kOuterShare);
  for (int y = 0; y < light.height; ++y) {
    for (int x = 0; x < light.width; ++x) {
      const Eigen::Vector2f& projector_px = light.at(x, y);
      if (std::isnan(projector_px.x())) continue;
      const Eigen::Vector2d at = through(grid_of_camera, {x, y});
      if ((at - low).minCoeff() < 0 || (high - at).minCoeff() < 0) continue;
      pixels.push_back({Eigen::Vector2d(x, y), projector_px.cast<double>()});
    }
  }
  return pixels;
}

/// Returns the map from the camera's pixels to the projector's by the board's plane, lenses left
/// out.
Eigen::Matrix3d planeOf(const std::vector<LitPixel>& pixels, double tolerance) {
  constexpr std::size_t kEnough = 2000;
  std::vector<cv::Point2d> camera, projector;
  const std::size_t step = std::max<std::size_t>(1, pixels.size() / kEnough);
  for (std::size_t i = 0; i < pixels.size(); i += step) {
    camera.emplace_back(pixels[i].camera_px.x(), pixels[i].camera_px.y());
    projector.emplace_back(pixels[i].projector_px.x(), pixels[i].projector_px.y());
  }
  return homographyOf(camera, projector, tolerance);
}

/// The place of a pixel within its cell by the plane (0 to 1), and how far the code is from that.
struct CellPixel {
  Eigen::Vector2d within, off;
};

Eigen::Vector4d weightsAt(const Eigen::Vector2d& within) {
  const double u = within.x(), v = within.y();
  return {(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v};
}

/// The light's distance from the plane's prediction at a cell's corners, bilinear between them.
struct CellFit {
  Eigen::Matrix<double, 4, 2> off = Eigen::Matrix<double, 4, 2>::Zero();
  Eigen::Matrix4d spread = Eigen::Matrix4d::Zero();  ///< covariance of each column, projector px^2
};

void dropMisread(std::vector<CellPixel>& pixels, double largest_off) {
  std::vector<double> x, y;
  for (const CellPixel& pixel : pixels) {
    x.push_back(pixel.off.x());
    y.push_back(pixel.off.y());
  }
  const Eigen::Vector2d middle(median(x, 0), median(y, 0));
  const auto end = std::remove_if(pixels.begin(), pixels.end(), [&](const CellPixel& pixel) {
    return (pixel.off - middle).cwiseAbs().maxCoeff() > largest_off;
  });
  pixels.erase(end, pixels.end());
}

std::optional<CellFit> fitCell(std::vector<CellPixel> pixels, double stripe, double sharing) {
  dropMisread(pixels, kLargestOff * stripe);
  if (pixels.size() < kFewestPixels) return std::nullopt;
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
  Eigen::Matrix<double, 4, 2> right = Eigen::Matrix<double, 4, 2>::Zero();
  double squares = 0;
  for (const CellPixel& pixel : pixels) {
    const Eigen::Vector4d weights = weightsAt(pixel.within);
    normal += weights * weights.transpose();
    right += weights * pixel.off.transpose();
    squares += pixel.off.squaredNorm();
  }
  const Eigen::LDLT<Eigen::Matrix4d> solver(normal);
  if (solver.info() != Eigen::Success || !(solver.rcond() > 1e-6)) return std::nullopt;
  CellFit fit;
  fit.off = solver.solve(right);
  const double left = std::max(0.0, squares - (right.array() * fit.off.array()).sum());
  const double variance =
      std::max(left / (2 * double(pixels.size() - 4)), stripe * stripe / 24);
  fit.spread = variance * sharing * solver.solve(Eigen::Matrix4d::Identity());
  if (std::sqrt(fit.spread.diagonal().maxCoeff()) > kLargestSigma * stripe) return std::nullopt;
  return fit;
}

/// d to / d from of a homography.
Eigen::Matrix2d slopeOf(const Eigen::Matrix3d& H, const Eigen::Vector2d& p) {
  const Eigen::Vector3d q = H * p.homogeneous();
  return (H.topLeftCorner<2, 2>() - q.hnormalized() * H.bottomLeftCorner<1, 2>()) / q.z();
}

SeenTag seenCell(const Tag& cell, int size, const CellFit& fit,
                 const Eigen::Matrix3d& camera_of_projector) {
  SeenTag seen;
  seen.id = cell.id;
  Eigen::Matrix<double, 8, 8> slopes = Eigen::Matrix<double, 8, 8>::Zero(), spread = slopes;
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d& corner = cell.corners[i];
    Eigen::Vector2d predicted = corner;  // the place whose light, by the plane alone, is there
    for (int round = 0; round < 3; ++round) {
      const Eigen::Vector2d within = (predicted - cell.corners[0]) / size;
      predicted = corner - fit.off.transpose() * weightsAt(within);
    }
    const auto at = 2 * Eigen::Index(i);
    seen.corners[i] = through(camera_of_projector, predicted);
    slopes.block<2, 2>(at, at) = slopeOf(camera_of_projector, predicted);
    for (Eigen::Index k = 0; k < 4; ++k) {
      spread.block<2, 2>(at, 2 * k) =
          fit.spread(Eigen::Index(i), k) * Eigen::Matrix2d::Identity();
    }
  }
  seen.covariance = slopes * spread * slopes.transpose();
  return seen;
}

}  // namespace

Pattern cellPattern(const GrayCode& code) {
  Pattern pattern;
  pattern.width = code.across.pixels;
  pattern.height = code.down.pixels;
  const int size = cellSize(code);
  for (int row = 0; (row + 1) * size <= pattern.height; ++row) {
    for (int column = 0; (column + 1) * size <= pattern.width; ++column) {
      Tag cell;
      cell.id = kFirstPatternId + static_cast<int>(pattern.tags.size());
      const double left = edgeOf(column, size), right = edgeOf(column + 1, size);
      const double top = edgeOf(row, size), bottom = edgeOf(row + 1, size);
      cell.corners = {Eigen::Vector2d(left, top), {right, top}, {right, bottom}, {left, bottom}};
      pattern.tags.push_back(cell);
    }
  }
  return pattern;
}

double shareOutside(const DecodedLight& light, const Chessboard& chessboard,
                    const std::vector<Eigen::Vector2d>& corners_px) {
  const std::vector<LitPixel> pixels = pixelsOnBoard(light, chessboard, corners_px);
  const auto outside = std::count_if(pixels.begin(), pixels.end(), [](const LitPixel& pixel) {
    return !pixel.projector_px.allFinite();
  });
  return pixels.empty() ? 0 : double(outside) / double(pixels.size());
}

std::vector<SeenTag> litCells(const DecodedLight& light, const GrayCode& code,
                              const Pattern& cells, const Chessboard& chessboard,
                              const std::vector<Eigen::Vector2d>& corners_px) {
  std::vector<SeenTag> seen;
  const double stripe = std::max(code.across.step, code.down.step);
  std::vector<LitPixel> pixels = pixelsOnBoard(light, chessboard, corners_px);
  const auto end = std::remove_if(pixels.begin(), pixels.end(), [](const LitPixel& pixel) {
    return !pixel.projector_px.allFinite();
  });
  pixels.erase(end, pixels.end());
  const Eigen::Matrix3d projector_of_camera = planeOf(pixels, 3 * stripe);
  if (!projector_of_camera.allFinite()) return seen;
  const int size = cellSize(code), columns = code.across.pixels / size;
  const int rows = code.down.pixels / size;
  std::map<int, std::vector<CellPixel>> by_cell;
  for (const LitPixel& pixel : pixels) {
    // By the plane's prediction and not by the code: that would choose among the code's errors.
    const Eigen::Vector2d at = through(projector_of_camera, pixel.camera_px);
    const Eigen::Vector2d cell = (at.array() + 0.5) / size;
    const int column = static_cast<int>(std::floor(cell.x()));
    const int row = static_cast<int>(std::floor(cell.y()));
    if (column < 0 || row < 0 || column >= columns || row >= rows) continue;
    by_cell[row * columns + column].push_back(
        {cell - Eigen::Vector2d(column, row), pixel.projector_px - at});
  }
  const Eigen::Matrix3d camera_of_projector = projector_of_camera.inverse();
  for (const auto& [index, within] : by_cell) {
    const Tag& cell = cells.tags[std::size_t(index)];
    // Camera pixels that share a stripe share its rounding.
    const double area = slopeOf(camera_of_projector, cell.corners[0]).determinant();
    const double sharing = std::max(1.0, std::abs(area) * stripe * stripe);
    const auto fit = fitCell(within, stripe, sharing);
    if (fit) seen.push_back(seenCell(cell, size, *fit, camera_of_projector));
  }
  return seen;
}

}  // namespace afterglow::calib
