#include "calib/color/texture_photographs.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <stdexcept>

#include "calib/color/color_files.hpp"
#include "calib/color/color_photographs.hpp"
#include "calib/landing.hpp"

namespace afterglow::calib {
namespace {

constexpr int kMostSamples = 4;         // a side of a cell
constexpr double kPixelsPerCell = 1.5;  // of the projector
constexpr double kLeastLight = 0.02;    // of the brightest cells'
constexpr double kLeastDeterminant = 1e-3;
constexpr double kRim = 1;  // px of the projector's picture, whose edge is soft
constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

double percentile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// The region of the surface around places of a picture's border; empty: none of them is there.
std::optional<Eigen::AlignedBox2d> reachOf(const Lens& lens, const Eigen::Isometry3d& T) {
  constexpr int kSteps = 64;
  Eigen::AlignedBox2d box;
  for (int i = 0; i < kSteps; ++i) {
    const double along = static_cast<double>(i) / (kSteps - 1);
    const double x = along * (lens.width - 1), y = along * (lens.height - 1);
    for (const Eigen::Vector2d& pixel :
         {Eigen::Vector2d(x, 0), Eigen::Vector2d(x, lens.height - 1), Eigen::Vector2d(0, y),
          Eigen::Vector2d(lens.width - 1, y)}) {
      if (const auto place = landing(lens, pixel, T)) box.extend(*place);
    }
  }
  if (box.isEmpty()) return std::nullopt;
  return box;
}

/// Meters that a pixel is long on the surface, by its area.
double pixelSize(const Lens& lens, const Eigen::Isometry3d& T, const Eigen::Vector2d& place) {
  const Eigen::Vector3d p = T * Eigen::Vector3d(place.x(), place.y(), 0);
  const double density = lightDensity(lens, p, T.linear().col(2));
  return density > 0 ? 1 / std::sqrt(density * lens.width * lens.height) : 0;
}

/// The cells, and where the camera sees them.
class CellGrid {
 public:
  CellGrid(const TextureView& view, const TextureOptions& options)
      : camera_(view.camera.width, view.camera.height) {
    const Eigen::Isometry3d &T_camera = view.T_camera_surface.matrix(),
                            &T_projector = view.T_projector_surface.matrix();
    const auto lit = reachOf(view.projector, T_projector), seen = reachOf(view.camera, T_camera);
    if (!lit || !seen || !lit->intersects(*seen)) {
      throw std::runtime_error("the projector's light on '" + options.surface +
                               "' is not where the camera looks: is the surface where tf or the "
                               "tags say?");
    }
    Eigen::AlignedBox2d box = lit->intersection(*seen);
    if (!options.polygon.empty()) {
      Eigen::AlignedBox2d outline;
      for (const Eigen::Vector2d& corner : options.polygon) outline.extend(corner);
      if (!outline.intersects(box)) {
        throw std::runtime_error("the projector's light is not on '" + options.surface + "'");
      }
      box = box.intersection(outline);
    }
    const Eigen::Vector2d middle = box.center();
    const double of_camera = pixelSize(view.camera, T_camera, middle);
    cell =
        options.cell > 0
            ? options.cell
            : std::max(of_camera, kPixelsPerCell * pixelSize(view.projector, T_projector, middle));
    // Whole cells from the frame's origin on, so that two calibrations have the same ones.
    origin = cell * (box.min() / cell).array().floor().matrix();
    const Eigen::Vector2d size = ((box.max() - origin) / cell).array().ceil();
    if (!(size.prod() <= kMostTextureCells && size.maxCoeff() <= kMostTextureSide)) {
      throw std::runtime_error(fmt::format(
          "{:.0f} x {:.0f} cells of {:.1f} mm are more than {} million: give the surface an "
          "outline, or larger cells (--cell-mm)",
          size.x(), size.y(), 1000 * cell, kMostTextureCells / 1'000'000));
    }
    columns = std::max(1, static_cast<int>(size.x()));
    rows = std::max(1, static_cast<int>(size.y()));
    samples_ = std::clamp(static_cast<int>(std::ceil(cell / of_camera)), 1, kMostSamples);
    look(view);
  }

  Eigen::Vector2d middleOf(int column, int row) const {
    return origin + cell * Eigen::Vector2d(column + 0.5, row + 0.5);
  }

  /// The mean of an image over each cell; not a number where the camera does not see it whole.
  cv::Mat see(const cv::Mat& image) const {
    cv::Mat fine, cells;
    cv::remap(image, fine, x_, y_, cv::INTER_LINEAR, cv::BORDER_CONSTANT,
              cv::Scalar::all(kUnknown));
    if (samples_ == 1) return fine;
    cv::resize(fine, cells, cv::Size(columns, rows), 0, 0, cv::INTER_AREA);
    return cells;
  }

  Eigen::Vector2d origin{0, 0};
  double cell = 0;
  int columns = 0, rows = 0;

 private:
  void look(const TextureView& view) {
    x_ = cv::Mat(rows * samples_, columns * samples_, CV_32F, cv::Scalar(-1e4));
    y_ = x_.clone();
    for (int row = 0; row < x_.rows; ++row) {
      for (int column = 0; column < x_.cols; ++column) {
        const Eigen::Vector2d place =
            origin + cell / samples_ * Eigen::Vector2d(column + 0.5, row + 0.5);
        const auto pixel =
            project(view.camera, view.T_camera_surface * Eigen::Vector3d(place.x(), place.y(), 0));
        const bool is_seen = pixel && pixel->minCoeff() >= 0 && pixel->x() <= camera_.width - 1 &&
                             pixel->y() <= camera_.height - 1;
        if (!is_seen) continue;
        x_.at<float>(row, column) = static_cast<float>(pixel->x());
        y_.at<float>(row, column) = static_cast<float>(pixel->y());
      }
    }
  }

  cv::Size camera_;
  int samples_ = 1;
  cv::Mat x_, y_;  ///< pixels of the camera, by places on the surface
};

/// Photographs as light per cell.
class CellPhotographs {
 public:
  CellPhotographs(const TextureView& view, const TextureOptions& options, const CellGrid& grid)
      : size_(view.camera.width, view.camera.height), grid_(grid) {
    if (!options.flat.empty()) readFlat(options.flat);
  }

  cv::Mat read(const ColorFile& file) const {
    const cv::Mat image = load(file.path);
    cv::Mat light = linear(image), clipped;
    if (!shade_.empty()) cv::divide(light, shade_, light);
    cv::Mat channels[3];
    cv::split(image, channels);
    clipped = cv::max(cv::max(channels[0], channels[1]), channels[2]) > kBrightest;
    light.setTo(cv::Scalar::all(kUnknown), clipped);
    return grid_.see(light);
  }

 private:
  cv::Mat load(const std::string& path) const {
    cv::Mat image = loadColors(path);
    if (image.size() == size_) return image;
    throw std::runtime_error(fmt::format("{}: is of {} x {} pixels, the camera has {} x {}", path,
                                         image.cols, image.rows, size_.width, size_.height));
  }

  /// Smoothed: a lens shades smoothly, and the photograph has noise.
  void readFlat(const std::string& path) {
    shade_ = linear(load(path));
    cv::GaussianBlur(shade_, shade_, cv::Size(), size_.width / 80.0, 0, cv::BORDER_REPLICATE);
    std::vector<cv::Mat> channels;
    cv::split(shade_, channels);
    for (cv::Mat& channel : channels) {
      double least = 0, greatest = 0;
      cv::minMaxLoc(channel, &least, &greatest);
      if (least < 0.02 || greatest > 0.95 || least < 0.1 * greatest) {
        throw std::runtime_error(path +
                                 ": is not evenly lit, or over- or underexposed: photograph "
                                 "something plain that fills the picture");
      }
      channel /= greatest;
    }
    cv::merge(channels, shade_);
  }

  cv::Size size_;
  const CellGrid& grid_;
  cv::Mat shade_;
};

/// Rows 1, red, green, blue: what the photographs of a color tell each of a cell's unknowns, least
/// squares over all of them.
Eigen::MatrixXd weightsOf(const std::vector<ColorFile>& files, const ColorResponse& response) {
  Eigen::MatrixXd design(static_cast<Eigen::Index>(files.size()), 4);
  for (std::size_t i = 0; i < files.size(); ++i) {
    design.row(static_cast<Eigen::Index>(i)) << 1, response.light(files[i].shown).transpose();
  }
  return (design.transpose() * design).inverse() * design.transpose();
}

Eigen::Vector3d vectorOf(const cv::Vec3f& light) { return {light[2], light[1], light[0]}; }

class TextureFitter {
 public:
  TextureFitter(const std::string& folder, const TextureView& view, const TextureOptions& options)
      : view_(view), options_(options), grid_(view, options), photographs_(view, options, grid_) {
    for (const ColorFile& file : colorFiles(folder)) {
      (isCheck(file.shown) ? checks_ : fitted_).push_back(file);
    }
    fit_.color = fitColor(readColorPhotographs(folder));
  }

  TextureFit fit() {
    fitCells();
    keepKnown();
    tellWhite();
    tellReach();
    check();
    return std::move(fit_);
  }

 private:
  SurfaceTexture& texture() { return fit_.texture; }

  void fitCells() {
    texture().surface = options_.surface;
    texture().color = fit_.color.response;
    texture().origin = grid_.origin;
    texture().cell = grid_.cell;
    texture().columns = grid_.columns;
    texture().rows = grid_.rows;
    const Eigen::MatrixXd weights = weightsOf(fitted_, fit_.color.response);
    for (cv::Mat& unknown : unknowns_) {
      unknown = cv::Mat::zeros(grid_.rows, grid_.columns, CV_32FC3);
    }
    for (std::size_t i = 0; i < fitted_.size(); ++i) {
      const cv::Mat seen = photographs_.read(fitted_[i]);
      for (int k = 0; k < 4; ++k) {
        cv::scaleAdd(seen, weights(k, static_cast<Eigen::Index>(i)), unknowns_[k], unknowns_[k]);
      }
    }
  }

  /// Returns the light's density at a cell that the projector lights and that belongs to the
  /// surface; 0: another cell.
  double densityAt(int column, int row) const {
    const Eigen::Vector2d place = grid_.middleOf(column, row);
    const Eigen::Vector3d p = view_.T_projector_surface * Eigen::Vector3d(place.x(), place.y(), 0);
    const auto pixel = project(view_.projector, p);
    const bool is_lit = pixel && pixel->minCoeff() >= kRim &&
                        pixel->x() <= view_.projector.width - 1 - kRim &&
                        pixel->y() <= view_.projector.height - 1 - kRim;
    const bool is_surface = options_.polygon.empty() || isInside(options_.polygon, place);
    if (!is_lit || !is_surface) return 0;
    return lightDensity(view_.projector, p, view_.T_projector_surface.matrix().linear().col(2));
  }

  /// Cells as they are in the light of one density, without those that tell nothing.
  void keepKnown() {
    std::vector<double> densities, brightness;
    std::vector<double> density_of;
    for (int row = 0; row < grid_.rows; ++row) {
      for (int column = 0; column < grid_.columns; ++column) {
        TextureCell cell;
        const double density = densityAt(column, row);
        if (density > 0) {
          densities.push_back(density);
          cell.dark = vectorOf(unknowns_[0].at<cv::Vec3f>(row, column)).cwiseMax(0).cast<float>();
          for (int i = 0; i < 3; ++i) {
            cell.M_seen_light.col(i) =
                vectorOf(unknowns_[i + 1].at<cv::Vec3f>(row, column)).cwiseMax(0).cast<float>();
          }
          if (cell.M_seen_light.allFinite()) brightness.push_back(cell.M_seen_light.sum());
        }
        density_of.push_back(density);
        texture().cells.push_back(cell);
      }
    }
    texture().density = percentile(densities, 0.5);
    const double least = kLeastLight * percentile(brightness, 0.99);
    std::size_t known = 0;
    for (std::size_t i = 0; i < density_of.size(); ++i) {
      TextureCell& cell = texture().cells[i];
      if (density_of[i] > 0 && isUsable(cell, least)) {
        cell.M_seen_light *= static_cast<float>(texture().density / density_of[i]);
        density_.push_back(density_of[i]);
        known_.push_back(i);
        ++known;
      } else {
        cell = {};
      }
    }
    if (known == 0) {
      throw std::runtime_error("no part of '" + options_.surface +
                               "' is seen by the camera and lit: is it where tf or the tags say?");
    }
    fit_.known_share = static_cast<double>(known) / static_cast<double>(densities.size());
  }

  static bool isUsable(const TextureCell& cell, double least) {
    const Eigen::Matrix3d M = cell.M_seen_light.cast<double>();
    return M.allFinite() && cell.dark.allFinite() && M.sum() > least &&
           std::abs(M.determinant()) > kLeastDeterminant * M.colwise().norm().prod();
  }

  /// Most of light that a channel gives at a known cell.
  double mostAt(std::size_t known) const { return density_[known] / fit_.texture.density; }

  void tellWhite() {
    std::vector<double> grays;
    for (std::size_t i = 0; i < known_.size(); ++i) {
      const TextureCell& cell = texture().cells[known_[i]];
      const Eigen::Matrix3d M_light_seen = cell.M_seen_light.cast<double>().inverse();
      grays.push_back(
          brightestGray(M_light_seen, M_light_seen * cell.dark.cast<double>(), mostAt(i)));
    }
    fit_.white = evenWhite(grays);
    fit_.median_gray = percentile(grays, 0.5);
    if (!(fit_.white > 0)) {
      throw ColorRefused(
          "parts of the surface have no gray: they are too dark, or the room is too bright");
    }
  }

  /// Steps through some of the known cells.
  std::size_t stride() const { return std::max<std::size_t>(1, known_.size() / 2000); }

  void tellReach() {
    constexpr int kSteps = 9;
    constexpr double kTolerance = 0.01;
    std::size_t reached = 0, all = 0;
    for (std::size_t k = 0; k < known_.size(); k += stride()) {
      const TextureCell& cell = texture().cells[known_[k]];
      const Eigen::Matrix3d inverse = cell.M_seen_light.cast<double>().inverse();
      const Eigen::Vector3d in_dark = inverse * cell.dark.cast<double>();
      for (int i = 1; i < kSteps * kSteps * kSteps; ++i) {
        const auto step = [](int n) { return lightOfSrgb(n % kSteps / (kSteps - 1.0)); };
        const Eigen::Vector3d wanted(step(i), step(i / kSteps), step(i / kSteps / kSteps));
        const Eigen::Vector3d light = (fit_.white * inverse * wanted - in_dark) / mostAt(k);
        ++all;
        if (light.minCoeff() >= -kTolerance && light.maxCoeff() <= 1 + kTolerance) ++reached;
      }
    }
    fit_.share_reached = static_cast<double>(reached) / static_cast<double>(all);
  }

  void check() {
    std::vector<double> off;
    for (const ColorFile& file : checks_) {
      const cv::Mat seen = photographs_.read(file);
      const Eigen::Vector3d light = fit_.color.response.light(file.shown);
      for (std::size_t k = 0; k < known_.size(); k += stride()) {
        const TextureCell& cell = texture().cells[known_[k]];
        const Eigen::Vector3d is =
            vectorOf(seen.at<cv::Vec3f>(static_cast<int>(known_[k] / std::size_t(grid_.columns)),
                                        static_cast<int>(known_[k] % std::size_t(grid_.columns))));
        if (!is.allFinite()) continue;
        const Eigen::Vector3d expected =
            cell.dark.cast<double>() + mostAt(k) * cell.M_seen_light.cast<double>() * light;
        off.push_back(colorDifference(labOf(expected / fit_.white), labOf(is / fit_.white)));
      }
    }
    if (off.empty()) return;
    fit_.checks = static_cast<int>(checks_.size());
    fit_.check_median = percentile(off, 0.5);
    fit_.check_p95 = percentile(off, 0.95);
  }

  const TextureView& view_;
  const TextureOptions& options_;
  const CellGrid grid_;
  const CellPhotographs photographs_;
  std::vector<ColorFile> fitted_, checks_;
  cv::Mat unknowns_[4];             ///< dark, red, green, blue by cells
  std::vector<std::size_t> known_;  ///< known cells
  std::vector<double> density_;     ///< the light's density at them
  TextureFit fit_;
};

}  // namespace

TextureFit fitTexture(const std::string& folder, const TextureView& view,
                      const TextureOptions& options) {
  return TextureFitter(folder, view, options).fit();
}

}  // namespace afterglow::calib
