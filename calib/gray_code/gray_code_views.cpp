#include "calib/gray_code/gray_code_views.hpp"

#include <fmt/format.h>

#include <stdexcept>

#include "calib/gray_code/lit_cells.hpp"
#include "calib/gray_code/set.hpp"
#include "calib/parallel.hpp"

namespace afterglow::calib {
namespace {

/// Share of a board's pixels; misreadings are fewer.
constexpr double kLargestOutside = 0.02;

struct Pose {
  View view;
  Picture white;
  std::vector<Eigen::Vector2d> corners_px;  ///< empty if the chessboard was not found
};

std::vector<Picture> loadAll(const GrayCodeFiles& files, const std::optional<Lens>& camera) {
  std::vector<Picture> pictures;
  for (const std::string& path : files.paths) {
    pictures.push_back(loadPicture(path));
    const Picture& picture = pictures.back();
    const Picture& first = pictures.front();
    if (picture.width != first.width || picture.height != first.height) {
      throw std::runtime_error(fmt::format("{}: {} x {} px, the pictures before it {} x {}", path,
                                           picture.width, picture.height, first.width,
                                           first.height));
    }
    if (camera && (picture.width != camera->width || picture.height != camera->height)) {
      throw std::runtime_error(fmt::format("{}: {} x {} px, the camera_info says {} x {}", path,
                                           picture.width, picture.height, camera->width,
                                           camera->height));
    }
  }
  return pictures;
}

std::uint64_t lightOf(const Picture& picture) {
  std::uint64_t sum = 0;
  for (const std::uint8_t pixel : picture.pixels) sum += pixel;
  return sum;
}

GrayCode codeOf(const GrayCodeFiles& files, const GrayCodeOptions& options) {
  try {
    return grayCodeOf(files.layout, files.paths.size(), options.width, options.height,
                      options.step);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(options.folder + "/" + files.name + ": " + error.what());
  }
}

Pose readPose(const GrayCodeFiles& files, const GrayCodeOptions& options, const Pattern& cells) {
  const GrayCode code = codeOf(files, options);
  std::vector<Picture> pictures = loadAll(files, options.camera);
  Pose pose;
  pose.view.name = files.name;
  pose.white = pictures[code.white()];
  if (lightOf(pose.white) <= lightOf(pictures[code.white() + 1])) {
    throw std::runtime_error(fmt::format(
        "{}: is not brighter than {}, though the one should show white and the other black: do "
        "the pictures belong to this layout?",
        files.paths[code.white()], files.paths[code.white() + 1]));
  }
  const auto corners = findCorners(pose.white, options.chessboard);
  if (!corners) {
    pose.view.faults.push_back(fmt::format("no chessboard of {} x {} inner corners was found in {}",
                                           options.chessboard.columns, options.chessboard.rows,
                                           files.paths[code.white()]));
    return pose;
  }
  pose.corners_px = *corners;
  pose.view.board = options.chessboard.tags(*corners);
  const DecodedLight light = decode(pictures, code);
  const double outside = shareOutside(light, options.chessboard, *corners);
  if (outside > kLargestOutside) {
    throw std::runtime_error(fmt::format(
        "{}/{}: {:.0f} % of the chessboard shows codes beyond {} x {} px: --projector is not the "
        "resolution that the stripes were made for",
        options.folder, files.name, 100 * outside, options.width, options.height));
  }
  pose.view.projected = litCells(light, code, cells, options.chessboard, *corners);
  if (pose.view.projected.empty()) {
    pose.view.faults.push_back(
        "hardly a pixel on the chessboard could be decoded: is it lit by the stripes, are they "
        "sharp, and is --projector the resolution they were made for?");
  }
  return pose;
}

}  // namespace

GrayCodeViews readGrayCode(const GrayCodeOptions& options) {
  const std::vector<GrayCodeFiles> files = findGrayCode(options.folder);
  GrayCodeViews result;
  result.board = options.chessboard.board();
  result.pattern = cellPattern(codeOf(files.front(), options));
  std::vector<Pose> poses(files.size());
  forEachIndex(files.size(), options.threads, [&](std::size_t i) {
    poses[i] = readPose(files[i], options, result.pattern);
  });
  std::vector<std::vector<Eigen::Vector2d>> corners;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    Pose& pose = poses[i];
    const Picture& first = poses.front().white;
    if (pose.white.width != first.width || pose.white.height != first.height) {
      throw std::runtime_error(fmt::format(
          "{}/{}: pictures of {} x {} px, those of {} have {} x {}", options.folder, files[i].name,
          pose.white.width, pose.white.height, files.front().name, first.width, first.height));
    }
    if (!pose.corners_px.empty()) corners.push_back(pose.corners_px);
    result.views.push_back(pose.view);
  }
  const Picture& first = poses.front().white;
  result.camera = options.camera ? *options.camera
                                 : cameraFromChessboards(corners, options.chessboard, first.width,
                                                         first.height);
  for (Pose& pose : poses) {
    result.photographs.push_back({pose.view.name, std::move(pose.white), std::nullopt});
  }
  return result;
}

}  // namespace afterglow::calib
