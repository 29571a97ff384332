#include "calib/detection/observe.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <map>
#include <opencv2/calib3d.hpp>
#include <stdexcept>

#include "calib/detection/tag_detector.hpp"
#include "calib/detection/tag_fit.hpp"
#include "calib/detection/view_faults.hpp"
#include "calib/median.hpp"

namespace afterglow::calib {
namespace {

using Corners = std::array<Eigen::Vector2d, 4>;

/// A fit with a lower correlation than this is no tag.
constexpr double kLeastCorrelation = 0.85;
/// The same for a tag that was predicted, not detected.
constexpr double kLeastCorrelationUnread = 0.93;
/// A corner that the fit moved further than this from AprilTag's is wrong.
constexpr double kLargestShift_px = 2.0;
/// Projected tags keep this far from the sheet's edge.
constexpr double kSheetMargin_m = 0.002;

/// H with to ~ H * from, robustly, from tags' corners. Empty if fewer than two tags agree.
std::optional<Eigen::Matrix3d> robustHomography(const std::vector<Corners>& from,
                                                const std::vector<Corners>& to, double tolerance) {
  if (from.size() < 2) return std::nullopt;
  std::vector<cv::Point2d> a, b;
  for (std::size_t i = 0; i < from.size(); ++i) {
    for (std::size_t k = 0; k < 4; ++k) {
      a.emplace_back(from[i][k].x(), from[i][k].y());
      b.emplace_back(to[i][k].x(), to[i][k].y());
    }
  }
  cv::setRNGSeed(1);
  cv::Mat inliers;
  const cv::Mat H = cv::findHomography(a, b, cv::RANSAC, tolerance, inliers, 500);
  if (H.empty() || cv::countNonZero(inliers) < 8) return std::nullopt;
  Eigen::Matrix3d result;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) result(row, column) = H.at<double>(row, column);
  }
  return result;
}

Eigen::Vector2d apply(const Eigen::Matrix3d& H, const Eigen::Vector2d& p) {
  return (H * p.homogeneous()).hnormalized();
}

double largestShift(const Corners& a, const Corners& b) {
  double shift = 0;
  for (std::size_t i = 0; i < 4; ++i) shift = std::max(shift, (a[i] - b[i]).norm());
  return shift;
}

double middleSide(const std::vector<Corners>& tags) {
  std::vector<double> sides;
  for (const Corners& tag : tags) sides.push_back((tag[1] - tag[0]).norm());
  return median(sides, 0);
}

/// Returns true if most of the tags lie together as they should: on one plane seen in perspective.
bool areLaidOut(const std::vector<Corners>& layout, const std::vector<Corners>& seen,
                double tolerance) {
  constexpr double kMost = 0.6;
  const auto H = robustHomography(layout, seen, tolerance);
  if (!H) return false;
  std::size_t fit = 0;
  for (std::size_t i = 0; i < layout.size(); ++i) {
    Corners expected;
    for (std::size_t k = 0; k < 4; ++k) expected[k] = apply(*H, layout[i][k]);
    if (largestShift(expected, seen[i]) < 2 * tolerance) ++fit;
  }
  return double(fit) >= kMost * double(layout.size());
}

/// The tag with its white rim: a cell more on every side.
Corners withRim(const Corners& corners) {
  const Eigen::Vector2d middle = (corners[0] + corners[1] + corners[2] + corners[3]) / 4;
  Corners grown = corners;
  for (Eigen::Vector2d& corner : grown) {
    corner = middle + (corner - middle) * double(kTagCells + 2) / kTagCells;
  }
  return grown;
}

}  // namespace

struct ViewReader::Impl {
  Board board;
  Pattern pattern;
  Lens camera;
  RayMap rays;
  std::map<int, const Tag*> board_tags, pattern_tags;
  std::map<int, TagCells> board_cells, pattern_cells;

  Impl(const Board& b, const Pattern& p, const Lens& c) : board(b), pattern(p), camera(c), rays(c) {
    for (const Tag& tag : board.tags) {
      board_tags[tag.id] = &tag;
      board_cells[tag.id] = tagCells(board.family, tag.id);
    }
    for (const Tag& tag : pattern.tags) {
      pattern_tags[tag.id] = &tag;
      pattern_cells[tag.id] = tagCells(pattern.family, tag.id);
    }
  }

  void requireSize(const Picture& picture, const std::string& name) const {
    if (picture.width == camera.width && picture.height == camera.height) return;
    throw std::invalid_argument(
        fmt::format("{}: the picture has {} x {} pixels, the camera_info says {} x {}", name,
                    picture.width, picture.height, camera.width, camera.height));
  }

  Eigen::Vector2d ideal(const Eigen::Vector2d& pixel) const {
    return (camera.K * rays.ray(pixel).homogeneous()).head<2>();
  }
  Corners ideal(const Corners& corners) const {
    return {ideal(corners[0]), ideal(corners[1]), ideal(corners[2]), ideal(corners[3])};
  }
  /// Empty if the ideal pixel is outside the lens's reach.
  std::optional<Eigen::Vector2d> pixelOf(const Eigen::Vector2d& at) const {
    const Eigen::Vector2d n = (camera.K.inverse() * at.homogeneous()).hnormalized();
    return project(camera, n.homogeneous());
  }
  std::optional<Corners> pixelsOf(const Eigen::Matrix3d& ideal_of_plane,
                                  const Corners& plane) const {
    Corners result;
    for (std::size_t i = 0; i < 4; ++i) {
      const auto pixel = pixelOf(apply(ideal_of_plane, plane[i]));
      if (!pixel) return std::nullopt;
      result[i] = *pixel;
    }
    return result;
  }

  /// The board's plane (meters) to the camera's ideal pixels.
  std::optional<Eigen::Matrix3d> boardPlane(const std::vector<SeenTag>& printed) const {
    std::vector<Corners> on_board, seen;
    for (const SeenTag& tag : printed) {
      on_board.push_back(board_tags.at(tag.id)->corners);
      seen.push_back(ideal(tag.corners));
    }
    return robustHomography(on_board, seen, 3);
  }

  /// Fewer tags than this tell nothing about the layout: they may be misread, or belong to another
  /// pattern.
  static constexpr std::size_t kTellingPrinted = 4, kTellingProjected = 2;

  void judgePrint(View& view) const {
    std::vector<Corners> on_board, seen;
    for (const SeenTag& tag : view.board) {
      on_board.push_back(board_tags.at(tag.id)->corners);
      seen.push_back(ideal(tag.corners));
    }
    if (seen.size() < kTellingPrinted || areLaidOut(on_board, seen, 3)) return;
    view.faults.push_back("the printed tags do not lie as the layout (board.yaml) of the " +
                          boardName(board) +
                          " board says: is it another board's, or is the "
                          "board bent?");
  }

  /// The projector's lens, unknown as yet, may bend the pattern by a part of a tag.
  void judgePattern(View& view) const {
    constexpr double kOfATag = 0.25;
    std::vector<Corners> in_pattern, seen;
    for (const SeenTag& tag : view.projected) {
      in_pattern.push_back(pattern_tags.at(tag.id)->corners);
      seen.push_back(ideal(tag.corners));
    }
    if (seen.size() < kTellingProjected || areLaidOut(in_pattern, seen, kOfATag * middleSide(seen)))
      return;
    view.faults.push_back(
        fmt::format("the projected tags do not lie as the pattern (pattern.yaml) of {} x {} pixels "
                    "says: is another one shown, of another resolution, or one made with --single?",
                    pattern.width, pattern.height));
  }

  bool isOnSheet(const Corners& camera_px, const Eigen::Matrix3d& board_of_ideal) const {
    const Eigen::Vector2d limit = board.size_m / 2 - Eigen::Vector2d::Constant(kSheetMargin_m);
    const Corners corners = withRim(ideal(camera_px));
    return std::all_of(corners.begin(), corners.end(), [&](const Eigen::Vector2d& corner) {
      const Eigen::Vector2d p = apply(board_of_ideal, corner);
      return (p.cwiseAbs() - limit).maxCoeff() < 0;
    });
  }

  ViewDetections detectAll(const Photographs& photographs, const Light& pattern_light) const {
    // Made for each call: a detector serves one thread, a reader all threads.
    std::vector<TagDetector> full, quick;
    full.emplace_back(board.family);
    quick.emplace_back(board.family, 2);
    if (pattern.family != board.family) {
      full.emplace_back(pattern.family);
      quick.emplace_back(pattern.family, 2);
    }
    const auto detect = [](const std::vector<TagDetector>& detectors, const Picture& picture) {
      std::vector<DetectedTag> tags;
      for (const TagDetector& detector : detectors) {
        for (const DetectedTag& tag : detector.detect(picture)) tags.push_back(tag);
      }
      return tags;
    };
    ViewDetections read;
    if (!photographs.plain) {
      read.pattern = detect(full, photographs.pattern);
      return read;
    }
    read.plain = detect(full, *photographs.plain);
    read.quotient = detect(full, encoded(pattern_light));
    read.pattern = detect(quick, photographs.pattern);
    return read;
  }

  std::optional<SeenTag> refit(const Light& light, const TagTarget& target, const Corners& start,
                               double least_correlation) const {
    const auto fit = fitTag(light, camera, rays, target, start);
    if (!fit || fit->correlation < least_correlation) return std::nullopt;
    if (largestShift(fit->seen.corners, start) > kLargestShift_px) return std::nullopt;
    return fit->seen;
  }

  std::vector<SeenTag> readPrinted(const std::vector<DetectedTag>& detected,
                                   const Light& light) const {
    std::vector<SeenTag> seen;
    std::map<int, int> times;
    for (const DetectedTag& tag : detected) ++times[tag.id];
    for (const DetectedTag& tag : detected) {
      const auto target = board_tags.find(tag.id);
      if (target == board_tags.end() || times[tag.id] > 1) continue;
      const TagTarget wanted{*target->second, board_cells.at(tag.id)};
      if (auto fit = refit(light, wanted, tag.corners, kLeastCorrelation)) seen.push_back(*fit);
    }
    return seen;
  }

  /// Looks for board tags that the detector missed, where the other tags predict them.
  void addMissedPrinted(std::vector<SeenTag>& printed, const Light& light,
                        const Eigen::Matrix3d& ideal_of_board) const {
    for (const auto& [id, tag] : board_tags) {
      const int wanted_id = id;
      if (std::any_of(printed.begin(), printed.end(),
                      [&](const SeenTag& seen) { return seen.id == wanted_id; })) {
        continue;
      }
      const auto start = pixelsOf(ideal_of_board, tag->corners);
      if (!start) continue;
      const TagTarget wanted{*tag, board_cells.at(id)};
      if (auto fit = refit(light, wanted, *start, kLeastCorrelationUnread)) printed.push_back(*fit);
    }
  }

  View observe(const Photographs& photographs, bool refits_projected) const;
  View observeAgain(const View& first, const Photographs& photographs, const Lens& projector) const;
};

View ViewReader::Impl::observe(const Photographs& photographs, bool refits_projected) const {
  const bool is_pair = photographs.plain.has_value();
  requireSize(photographs.pattern, photographs.name);
  if (is_pair) requireSize(*photographs.plain, photographs.name + "_plain");
  View view;
  view.name = photographs.name;
  const Picture& for_board = is_pair ? *photographs.plain : photographs.pattern;
  const Light board_light = linearLight(for_board);
  const Light pattern_light =
      is_pair ? quotient(linearLight(photographs.pattern), board_light) : board_light;
  const ViewDetections read = detectAll(photographs, pattern_light);
  const ViewFaults judged = viewFaults(photographs, read, board, pattern);
  view.faults = judged.faults;
  view.notes = judged.notes;
  view.board = readPrinted(is_pair ? read.plain : read.pattern, board_light);
  judgePrint(view);
  const auto ideal_of_board = boardPlane(view.board);
  if (!ideal_of_board) return view;
  addMissedPrinted(view.board, board_light, *ideal_of_board);
  const Eigen::Matrix3d board_of_ideal = ideal_of_board->inverse();
  int beside = 0;
  for (const DetectedTag& tag : is_pair ? read.quotient : read.pattern) {
    const auto target = pattern_tags.find(tag.id);
    if (target == pattern_tags.end()) continue;
    if (!isOnSheet(tag.corners, board_of_ideal)) {
      ++beside;
      continue;
    }
    if (!refits_projected) {
      SeenTag seen;
      static_cast<Tag&>(seen) = tag;
      view.projected.push_back(seen);
      continue;
    }
    const TagTarget wanted{*target->second, pattern_cells.at(tag.id)};
    if (auto fit = refit(pattern_light, wanted, tag.corners, kLeastCorrelation)) {
      view.projected.push_back(*fit);
    }
  }
  judgePattern(view);
  if (beside > 0) {
    view.notes.push_back(std::to_string(beside) + " projected tags beside the board left out");
  }
  return view;
}

View ViewReader::Impl::observeAgain(const View& first, const Photographs& photographs,
                                    const Lens& projector) const {
  const bool is_pair = photographs.plain.has_value();
  View view = first;
  view.projected.clear();
  const auto ideal_of_board = boardPlane(first.board);
  if (!ideal_of_board) return first;
  const Eigen::Matrix3d board_of_ideal = ideal_of_board->inverse();
  const Light board_light = linearLight(is_pair ? *photographs.plain : photographs.pattern);
  const Light pattern_light =
      is_pair ? quotient(linearLight(photographs.pattern), board_light) : board_light;

  // Undistorted projector coordinates map to the board by a homography, exactly.
  const auto undistorted = [&](const Tag& tag) -> std::optional<Corners> {
    Corners result;
    for (std::size_t i = 0; i < 4; ++i) {
      const auto ray = unproject(projector, tag.corners[i]);
      if (!ray) return std::nullopt;
      result[i] = ray->head<2>();
    }
    return result;
  };
  std::vector<Corners> in_projector, seen;
  for (const SeenTag& tag : first.projected) {
    const auto corners = undistorted(*pattern_tags.at(tag.id));
    if (!corners) continue;
    in_projector.push_back(*corners);
    seen.push_back(ideal(tag.corners));
  }
  const auto ideal_of_projector = robustHomography(in_projector, seen, 3);
  if (!ideal_of_projector) return first;
  for (const auto& [id, tag] : pattern_tags) {
    const auto corners = undistorted(*tag);
    if (!corners) continue;
    const auto start = pixelsOf(*ideal_of_projector, *corners);
    if (!start || !isOnSheet(*start, board_of_ideal)) continue;
    const int wanted_id = id;
    const bool was_read = std::any_of(first.projected.begin(), first.projected.end(),
                                      [&](const SeenTag& other) { return other.id == wanted_id; });
    const TagTarget wanted{*tag, pattern_cells.at(id), &projector};
    const double least = was_read ? kLeastCorrelation : kLeastCorrelationUnread;
    if (auto fit = refit(pattern_light, wanted, *start, least)) view.projected.push_back(*fit);
  }
  return view;
}

ViewReader::ViewReader(const Board& board, const Pattern& pattern, const Lens& camera)
    : impl_(std::make_unique<Impl>(board, pattern, camera)) {}
ViewReader::~ViewReader() = default;
ViewReader::ViewReader(ViewReader&&) noexcept = default;

View ViewReader::observe(const Photographs& photographs) const {
  return impl_->observe(photographs, true);
}

View ViewReader::glance(const Photographs& photographs) const {
  return impl_->observe(photographs, false);
}

View ViewReader::observeAgain(const View& first, const Photographs& photographs,
                              const Lens& projector) const {
  return impl_->observeAgain(first, photographs, projector);
}

}  // namespace afterglow::calib
