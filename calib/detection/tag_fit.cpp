#include "calib/detection/tag_fit.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <stdexcept>

namespace afterglow::calib {
namespace {

constexpr double kGamma = 2.2;

struct Decoded {
  float value, weight;
};

std::array<Decoded, 256> decodingTable() {
  std::array<Decoded, 256> table{};
  for (std::size_t gray = 0; gray < 256; ++gray) {
    const double g = double(gray) / 255;
    // The curve is flat at black; a gray level below 4 is as uncertain as one of 4.
    const double slope = kGamma * std::pow(std::max(g, 4.0 / 255), kGamma - 1) / 255;
    const double sigma = slope * kGrayNoise;
    table[gray] = {float(std::pow(g, kGamma)), gray >= 254 ? 0.0f : float(1 / (sigma * sigma))};
  }
  return table;
}

/// Squared length of the gradient of ln(light), 1/px^2.
double relativeEdge(const Light& light, int x, int y) {
  const auto at = [&](int u, int v) {
    u = std::clamp(u, 0, light.width - 1);
    v = std::clamp(v, 0, light.height - 1);
    return double(light.value[std::size_t(v) * std::size_t(light.width) + std::size_t(u)]);
  };
  const double dx = (at(x + 1, y) - at(x - 1, y)) / 2, dy = (at(x, y + 1) - at(x, y - 1)) / 2;
  const double middle = std::max(at(x, y), 1e-4);
  return (dx * dx + dy * dy) / (middle * middle);
}

}  // namespace

Light linearLight(const Picture& picture) {
  static const std::array<Decoded, 256> table = decodingTable();
  Light light;
  light.width = picture.width;
  light.height = picture.height;
  light.value.resize(picture.pixels.size());
  light.weight.resize(picture.pixels.size());
  for (std::size_t i = 0; i < picture.pixels.size(); ++i) {
    light.value[i] = table[picture.pixels[i]].value;
    light.weight[i] = table[picture.pixels[i]].weight;
  }
  return light;
}

Light quotient(const Light& pattern, const Light& plain) {
  if (pattern.width != plain.width || pattern.height != plain.height) {
    throw std::invalid_argument(
        fmt::format("the pattern's picture is {} x {}, the plain one {} x {}", pattern.width,
                    pattern.height, plain.width, plain.height));
  }
  // Where print and pattern both have an edge, blur does not commute with the quotient: the error
  // is about this many pixels times the print's relative edge.
  constexpr double kEdgeMisfit_px = 0.5;
  Light result;
  result.width = plain.width;
  result.height = plain.height;
  result.value.assign(plain.value.size(), 0);
  result.weight.assign(plain.value.size(), 0);
  for (int y = 0; y < plain.height; ++y) {
    for (int x = 0; x < plain.width; ++x) {
      const std::size_t i = std::size_t(y) * std::size_t(plain.width) + std::size_t(x);
      const double above = double(pattern.value[i]), below = std::max(double(plain.value[i]), 1e-4);
      const double q = above / below;
      result.value[i] = float(q);
      if (pattern.weight[i] == 0 || plain.weight[i] == 0) continue;
      const double variance = 1 / double(pattern.weight[i]) / (below * below) +
                              q * q / double(plain.weight[i]) / (below * below) +
                              q * q * kEdgeMisfit_px * kEdgeMisfit_px * relativeEdge(plain, x, y);
      result.weight[i] = float(1 / variance);
    }
  }
  return result;
}

Picture encoded(const Light& light) {
  std::vector<float> sorted = light.value;
  const auto high = sorted.begin() + std::ptrdiff_t(sorted.size() * 99 / 100);
  std::nth_element(sorted.begin(), high, sorted.end());
  const float scale = *high > 0 ? 1 / *high : 1;
  Picture picture{light.width, light.height, std::vector<std::uint8_t>(light.value.size())};
  for (std::size_t i = 0; i < light.value.size(); ++i) {
    // A square root is near enough to gamma 2.2 for a detector, and ten times as fast.
    const float level = 220 * std::sqrt(std::max(0.0f, light.value[i] * scale));
    picture.pixels[i] = std::uint8_t(std::min(level + 0.5f, 255.0f));
  }
  return picture;
}

namespace {

// ------------------------------------------------- a tag's cells after the blur of lens and pixels

/// The whiteness of a place of the tag after blurring, and its slopes along x and y (per cell) and
/// with the logarithm of the blur.
struct Whiteness {
  double value = 0, dx = 0, dy = 0, dblur = 0;
};

/// Cells seen through a Gaussian blur, in cell coordinates: the black frame spans 0 to kTagCells,
/// all around is white. The blur is separable along the tag's axes, if shear is neglected.
class BlurredTag {
 public:
  BlurredTag(const TagCells& cells, const Eigen::Vector2d& sigma_cells);

  /// Up to a cell and a half outside the black frame.
  Whiteness at(const Eigen::Vector2d& cell) const;

 private:
  /// White cells all around, so that no place needs a look at the edges.
  static constexpr int kMargin = 4, kSide = kTagCells + 2 * kMargin;
  std::array<std::array<double, kSide>, kSide> white_;  ///< 1 or 0
  Eigen::Vector2d sigma_;
};

/// Normal distribution and its density from a table, because fitting spends most of its time here.
class NormalTable {
 public:
  NormalTable() {
    for (std::size_t i = 0; i < kEntries; ++i) {
      const double t = (double(i) - kMiddle) / kPerUnit;
      below_[i] = 0.5 * std::erfc(-t / std::sqrt(2.0));
      density_[i] = std::exp(-0.5 * t * t) / std::sqrt(2 * 3.14159265358979);
    }
  }
  struct Value {
    double below, density;
  };
  /// Off by less than 1e-5, which is a thousandth of a gray level.
  Value at(double t) const {
    const double place = std::clamp(t * kPerUnit + kMiddle, 0.0, double(kEntries) - 1.001);
    const std::size_t i = static_cast<std::size_t>(place);
    const double part = place - double(i);
    return {below_[i] + part * (below_[i + 1] - below_[i]),
            density_[i] + part * (density_[i + 1] - density_[i])};
  }

 private:
  static constexpr double kPerUnit = 64, kMiddle = 5 * kPerUnit;
  static constexpr std::size_t kEntries = std::size_t(2 * kMiddle) + 2;
  std::array<double, kEntries> below_, density_;
};
const NormalTable kNormal;

/// Share of each of the nearest cells in a blurred point, along one axis.
struct Axis {
  static constexpr int kCells = 5;
  int first;
  double share[kCells], slope[kCells], blur[kCells];
  Axis(double asked, double sigma) {
    // All is white far from a tag, on the horizon, too, where a trial step may have put a pixel.
    constexpr double kFar = 1e3;
    const double at = std::isfinite(asked) ? std::clamp(asked, -kFar, kFar) : kFar;
    first = static_cast<int>(std::floor(at)) - kCells / 2;
    double below = 0, below_slope = 0, below_blur = 0;
    for (int i = 0; i < kCells; ++i) {
      // Weight of everything up to the cell's upper edge; the outermost cells extend to infinity.
      double upto = 1, upto_slope = 0, upto_blur = 0;
      if (i < kCells - 1) {
        const double t = (at - (first + i + 1)) / sigma;
        const NormalTable::Value normal = kNormal.at(-t);
        upto = normal.below;
        upto_slope = -normal.density / sigma;
        upto_blur = normal.density * t;
      }
      share[i] = upto - below;
      slope[i] = upto_slope - below_slope;
      blur[i] = upto_blur - below_blur;
      below = upto;
      below_slope = upto_slope;
      below_blur = upto_blur;
    }
  }
};

BlurredTag::BlurredTag(const TagCells& cells, const Eigen::Vector2d& sigma_cells)
    : sigma_(sigma_cells) {
  for (auto& row : white_) row.fill(1);
  for (std::size_t row = 0; row < kTagCells; ++row) {
    for (std::size_t column = 0; column < kTagCells; ++column) {
      if (cells[row][column]) white_[row + kMargin][column + kMargin] = 0;
    }
  }
}

Whiteness BlurredTag::at(const Eigen::Vector2d& cell) const {
  const Axis x(cell.x(), sigma_.x()), y(cell.y(), sigma_.y());
  const auto first = [](int at) {
    return static_cast<std::size_t>(std::clamp(at + kMargin, 0, kSide - Axis::kCells));
  };
  const std::size_t first_row = first(y.first), first_column = first(x.first);
  Whiteness result;
  for (std::size_t row = 0; row < Axis::kCells; ++row) {
    const double* white = &white_[first_row + row][first_column];
    double along = 0, along_slope = 0, along_blur = 0;
    for (std::size_t column = 0; column < Axis::kCells; ++column) {
      along += white[column] * x.share[column];
      along_slope += white[column] * x.slope[column];
      along_blur += white[column] * x.blur[column];
    }
    result.value += y.share[row] * along;
    result.dx += y.share[row] * along_slope;
    result.dy += y.slope[row] * along;
    result.dblur += y.share[row] * along_blur + y.blur[row] * along;
  }
  return result;
}

// --------------------------------------------------------------------------------------- the fit

using Corners = std::array<Eigen::Vector2d, 4>;

/// Corner positions (ideal pixels: camera.K on undistorted rays), then how the light falls.
enum Parameter {
  kCorner = 0,
  kBlack = 8,
  kWhite,
  kSlopeX,
  kSlopeY,
  kLogBlur,
  kGrowth,
  kParameters
};
using Parameters = Eigen::Matrix<double, kParameters, 1>;
using Normal = Eigen::Matrix<double, kParameters, kParameters>;

/// The white rim around the tag is one cell wide; what lies beyond it is not used.
constexpr double kRim_cells = 0.85;

Eigen::Matrix3d homography(const Corners& from, const Corners& to) {
  Eigen::Matrix<double, 8, 8> A = Eigen::Matrix<double, 8, 8>::Zero();
  Eigen::Matrix<double, 8, 1> b;
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector2d& p = from[std::size_t(i)];
    const Eigen::Vector2d& q = to[std::size_t(i)];
    A.row(2 * i) << p.x(), p.y(), 1, 0, 0, 0, -q.x() * p.x(), -q.x() * p.y();
    A.row(2 * i + 1) << 0, 0, 0, p.x(), p.y(), 1, -q.y() * p.x(), -q.y() * p.y();
    b.segment<2>(2 * i) = q;
  }
  const Eigen::Matrix<double, 8, 1> h = A.partialPivLu().solve(b);
  Eigen::Matrix3d H;
  H << h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1;
  return H;
}

struct Pixel {
  Eigen::Vector2d ideal;  ///< ideal pixels
  double light, weight;
};

class Fitter {
 public:
  Fitter(const Light& light, const Lens& camera, const RayMap& rays, const TagTarget& target)
      : light_(light), camera_(camera), rays_(rays), target_(target) {
    const Corners& c = target.tag.corners;
    along_x_ = (c[1] - c[0]) * kTagCells / (c[1] - c[0]).squaredNorm();
    along_y_ = (c[3] - c[0]) * kTagCells / (c[3] - c[0]).squaredNorm();
    for (std::size_t i = 0; i < 4; ++i) plane_[i] = onPlane(c[i]);
  }

  std::optional<TagFit> fit(const Corners& start) {
    for (std::size_t i = 0; i < 4; ++i) {
      theta_.segment<2>(kCorner + 2 * Eigen::Index(i)) = ideal(start[i]);
    }
    if (!theta_.head<8>().allFinite() || !collectPixels(start)) return std::nullopt;
    startPhotometry();
    if (!descend()) return std::nullopt;
    return result();
  }

 private:
  /// A point of the target in the plane that a homography maps to the camera's ideal pixels.
  Eigen::Vector2d onPlane(const Eigen::Vector2d& p) const {
    if (!target_.projector) return toCell(p);
    const auto ray = unproject(*target_.projector, p);
    return ray ? Eigen::Vector2d(ray->head<2>())
               : Eigen::Vector2d(Eigen::Vector2d::Constant(std::nan("")));
  }
  Eigen::Vector2d toCell(const Eigen::Vector2d& p) const {
    const Eigen::Vector2d d = p - target_.tag.corners[0];
    return {along_x_.dot(d), along_y_.dot(d)};
  }
  /// Cell coordinates of a point of that plane.
  Eigen::Vector2d cellOf(const Eigen::Vector2d& plane) const {
    if (!target_.projector) return plane;
    const Lens& lens = *target_.projector;
    const Eigen::Vector2d d = distort(lens, plane);
    return toCell({lens.K(0, 0) * d.x() + lens.K(0, 1) * d.y() + lens.K(0, 2),
                   lens.K(1, 1) * d.y() + lens.K(1, 2)});
  }
  /// Cell coordinates of an ideal pixel.
  Eigen::Vector2d cellAt(const Eigen::Matrix3d& plane_of_ideal, const Eigen::Vector2d& at) const {
    return cellOf((plane_of_ideal * at.homogeneous()).hnormalized());
  }
  Eigen::Vector2d ideal(const Eigen::Vector2d& pixel) const {
    return (camera_.K * rays_.ray(pixel).homogeneous()).head<2>();
  }
  Corners cornersOf(const Parameters& theta) const {
    Corners corners;
    for (std::size_t i = 0; i < 4; ++i) {
      corners[i] = theta.segment<2>(kCorner + 2 * Eigen::Index(i));
    }
    return corners;
  }
  Eigen::Matrix3d planeOfIdeal(const Parameters& theta) const {
    return homography(cornersOf(theta), plane_);
  }

  bool collectPixels(const Corners& start) {
    Eigen::Vector2d low = start[0], high = start[0], middle = Eigen::Vector2d::Zero();
    for (const Eigen::Vector2d& corner : start) {
      low = low.cwiseMin(corner);
      high = high.cwiseMax(corner);
      middle += corner / 4;
    }
    const double rim = (high - low).maxCoeff() * kRim_cells / kTagCells * 1.3;
    const int left = int(std::floor(low.x() - rim)), right = int(std::ceil(high.x() + rim));
    const int top = int(std::floor(low.y() - rim)), bottom = int(std::ceil(high.y() + rim));
    if (low.x() < 1 || low.y() < 1 || high.x() > light_.width - 2 || high.y() > light_.height - 2) {
      return false;
    }
    const Eigen::Matrix3d plane_of_ideal = planeOfIdeal(theta_);
    for (int y = std::max(top, 0); y <= std::min(bottom, light_.height - 1); ++y) {
      for (int x = std::max(left, 0); x <= std::min(right, light_.width - 1); ++x) {
        const std::size_t i = std::size_t(y) * std::size_t(light_.width) + std::size_t(x);
        if (light_.weight[i] == 0) continue;
        const Eigen::Vector2d at = ideal({double(x), double(y)});
        const Eigen::Vector2d cell = cellAt(plane_of_ideal, at);
        if (!(cell.array() > -kRim_cells && cell.array() < kTagCells + kRim_cells).all()) {
          continue;
        }
        pixels_.push_back({at, double(light_.value[i]), double(light_.weight[i])});
      }
    }
    middle_ = ideal(middle);
    radius_ = std::max(1.0, (high - low).maxCoeff() / 2);
    return pixels_.size() > 100;
  }

  void startPhotometry() {
    std::vector<double> values;
    values.reserve(pixels_.size());
    for (const Pixel& pixel : pixels_) values.push_back(pixel.light);
    std::sort(values.begin(), values.end());
    theta_[kBlack] = values[values.size() / 10];
    theta_[kWhite] = values[values.size() * 9 / 10];
    theta_[kSlopeX] = theta_[kSlopeY] = theta_[kGrowth] = 0;
    theta_[kLogBlur] = std::log(0.8);
  }

  /// d cell / d ideal pixel in the tag's middle.
  Eigen::Matrix2d cellsPerPixel(const Eigen::Matrix3d& plane_of_ideal) const {
    constexpr double kStep = 0.5;
    Eigen::Matrix2d J;
    for (int k = 0; k < 2; ++k) {
      const Eigen::Vector2d step = kStep * Eigen::Vector2d::Unit(k);
      J.col(k) = (cellAt(plane_of_ideal, middle_ + step) - cellAt(plane_of_ideal, middle_ - step)) /
                 (2 * kStep);
    }
    return J;
  }

  /// d cell / d plane in the tag's middle: the projector's distortion changes it little over a tag.
  Eigen::Matrix2d cellsPerPlane(const Eigen::Matrix3d& plane_of_ideal) const {
    if (!target_.projector) return Eigen::Matrix2d::Identity();
    constexpr double kStep = 1e-5;
    const Eigen::Vector2d at = (plane_of_ideal * middle_.homogeneous()).hnormalized();
    Eigen::Matrix2d J;
    for (int k = 0; k < 2; ++k) {
      const Eigen::Vector2d step = kStep * Eigen::Vector2d::Unit(k);
      J.col(k) = (cellOf(at + step) - cellOf(at - step)) / (2 * kStep);
    }
    return J;
  }

  /// Standard deviations of the blur along the tag's axes, in cells.
  static Eigen::Vector2d blurInCells(const Parameters& theta,
                                     const Eigen::Matrix2d& cells_per_pixel) {
    return (std::exp(theta[kLogBlur]) * cells_per_pixel.rowwise().norm())
        .cwiseMax(0.05)
        .cwiseMin(0.9);
  }

  /// Returns the slopes of the homography along each corner's coordinates, by differences.
  std::array<Eigen::Matrix3d, 8> homographySlopes(const Parameters& theta,
                                                  const Eigen::Matrix3d& H) const {
    constexpr double kStep = 1e-3;
    std::array<Eigen::Matrix3d, 8> slopes;
    for (int k = 0; k < 8; ++k) {
      Parameters other = theta;
      other[k] += kStep;
      slopes[std::size_t(k)] = (planeOfIdeal(other) - H) / kStep;
    }
    return slopes;
  }

  /// The image that a set of parameters predicts, compared with the real one.
  struct Evaluation {
    double cost = 0;  ///< sum of robust squared residuals
    Normal normal = Normal::Zero();
    Parameters gradient = Parameters::Zero();
    std::vector<double> residuals;  ///< residuals in standard deviations of the pixels

    void add(double residual, double limit, const Parameters& row) {
      const double size = std::abs(residual);
      const double trust = size > limit ? limit / size : 1;
      cost += size > limit ? limit * (2 * size - limit) : residual * residual;
      residuals.push_back(residual);
      normal.selfadjointView<Eigen::Lower>().rankUpdate(row, trust);
      gradient += trust * residual * row;
    }
  };

  Evaluation evaluate(const Parameters& theta) const {
    const Eigen::Matrix3d H = planeOfIdeal(theta);
    const Eigen::Matrix2d cells_per_pixel = cellsPerPixel(H), cells_per_plane = cellsPerPlane(H);
    const BlurredTag tag(target_.cells, blurInCells(theta, cells_per_pixel));
    const std::array<Eigen::Matrix3d, 8> slopes = homographySlopes(theta, H);
    const double contrast = theta[kWhite] - theta[kBlack];
    Evaluation result;
    result.residuals.reserve(pixels_.size());
    for (const Pixel& pixel : pixels_) {
      const Eigen::Vector3d ideal(pixel.ideal.x(), pixel.ideal.y(), 1);
      const Eigen::Vector3d on_plane = H * ideal;
      const Eigen::Vector2d plane = on_plane.hnormalized();
      const Whiteness white = tag.at(cellOf(plane));
      const Eigen::Vector2d per_cell(white.dx, white.dy);
      const double edge = (cells_per_pixel.transpose() * per_cell).norm();
      const double whiteness = white.value - theta[kGrowth] * edge;
      const Eigen::Vector2d offset = (pixel.ideal - middle_) / radius_;
      const double fall = 1 + theta[kSlopeX] * offset.x() + theta[kSlopeY] * offset.y();
      const double flat = theta[kBlack] + contrast * whiteness;
      const Eigen::Vector2d per_plane =
          cells_per_plane.transpose() * per_cell * (contrast * fall / on_plane.z());
      Parameters row;
      for (int k = 0; k < 8; ++k) {
        const Eigen::Vector3d moved = slopes[std::size_t(k)] * ideal;
        row[k] = per_plane.x() * (moved.x() - plane.x() * moved.z()) +
                 per_plane.y() * (moved.y() - plane.y() * moved.z());
      }
      row[kBlack] = fall * (1 - whiteness);
      row[kWhite] = fall * whiteness;
      row[kSlopeX] = flat * offset.x();
      row[kSlopeY] = flat * offset.y();
      row[kLogBlur] = contrast * fall * white.dblur;
      row[kGrowth] = -contrast * fall * edge;
      const double root = std::sqrt(pixel.weight);
      result.add((pixel.light - flat * fall) * root, 2.5 * scale_, row * root);
    }
    result.normal = result.normal.selfadjointView<Eigen::Lower>();
    return result;
  }

  /// Noise in units of the expected one, from the residuals' median.
  static double scaleOf(const std::vector<double>& residuals) {
    std::vector<double> sizes(residuals.size());
    std::transform(residuals.begin(), residuals.end(), sizes.begin(),
                   [](double r) { return std::abs(r); });
    const auto middle = sizes.begin() + std::ptrdiff_t(sizes.size() / 2);
    std::nth_element(sizes.begin(), middle, sizes.end());
    return std::max(1.4826 * *middle, 0.3);
  }

  std::optional<Parameters> stepFrom(const Evaluation& now, double damping) const {
    Normal damped = now.normal;
    damped.diagonal() *= 1 + damping;
    damped.diagonal().array() += 1e-9;
    Parameters step = damped.ldlt().solve(now.gradient);
    if (!step.allFinite()) return std::nullopt;
    step.head<8>() = step.head<8>().cwiseMax(-1).cwiseMin(1);
    return step;
  }

  /// Levenberg and Marquardt's method on Huber's cost.
  bool descend() {
    constexpr int kIterations = 20, kScalings = 2, kAttempts = 6;
    constexpr double kSmallStep_px = 5e-3;
    scale_ = 1e6;
    Evaluation now = evaluate(theta_);
    double damping = 1e-3;
    for (int iteration = 0; iteration < kIterations; ++iteration) {
      if (iteration < kScalings) {
        scale_ = scaleOf(now.residuals);
        now = evaluate(theta_);
      }
      bool improved = false;
      double moved = 0;
      for (int attempt = 0; attempt < kAttempts && !improved; ++attempt) {
        const auto step = stepFrom(now, damping);
        if (!step) return false;
        moved = step->head<8>().cwiseAbs().maxCoeff();
        Parameters next = theta_ + *step;
        next[kLogBlur] = std::clamp(next[kLogBlur], std::log(0.3), std::log(4.0));
        next[kGrowth] = std::clamp(next[kGrowth], -1.0, 1.0);
        Evaluation there = evaluate(next);
        improved = there.cost <= now.cost;
        if (improved) {
          theta_ = next;
          now = std::move(there);
        }
        damping *= improved ? 0.1 : 10;
      }
      if (iteration >= kScalings && (!improved || moved < kSmallStep_px)) break;
    }
    scale_ = scaleOf(now.residuals);
    double sum = 0;
    for (double residual : now.residuals) sum += residual * residual;
    // Shadows and edges of light, which the residuals' median ignores, widen it.
    const double mean_square = std::max(sum / double(now.residuals.size()), scale_ * scale_);
    covariance_ = now.normal.ldlt().solve(Normal::Identity()) * mean_square;
    return theta_.allFinite() && theta_[kWhite] > theta_[kBlack];
  }

  double correlation() const {
    const Eigen::Matrix3d H = planeOfIdeal(theta_);
    const BlurredTag tag(target_.cells, blurInCells(theta_, cellsPerPixel(H)));
    double n = 0, x = 0, y = 0, xx = 0, yy = 0, xy = 0;
    for (const Pixel& pixel : pixels_) {
      const double white = tag.at(cellAt(H, pixel.ideal)).value;
      n += 1, x += white, y += pixel.light;
      xx += white * white, yy += pixel.light * pixel.light, xy += white * pixel.light;
    }
    const double spread = (xx - x * x / n) * (yy - y * y / n);
    return spread > 0 ? (xy - x * y / n) / std::sqrt(spread) : 0;
  }

  std::optional<TagFit> result() const {
    TagFit fit;
    fit.correlation = correlation();
    fit.seen.id = target_.tag.id;
    Eigen::Matrix<double, 8, 8> J = Eigen::Matrix<double, 8, 8>::Zero();
    const Corners corners = cornersOf(theta_);
    const Eigen::Matrix3d K_inverse = camera_.K.inverse();
    for (std::size_t i = 0; i < 4; ++i) {
      const auto pixelOf = [&](const Eigen::Vector2d& at) {
        return project(camera_, K_inverse * at.homogeneous());
      };
      const auto pixel = pixelOf(corners[i]);
      const auto right = pixelOf(corners[i] + Eigen::Vector2d(0.5, 0));
      const auto below = pixelOf(corners[i] + Eigen::Vector2d(0, 0.5));
      if (!pixel || !right || !below) return std::nullopt;
      fit.seen.corners[i] = *pixel;
      const Eigen::Index k = 2 * Eigen::Index(i);
      J.block<2, 1>(k, k) = (*right - *pixel) / 0.5;
      J.block<2, 1>(k, k + 1) = (*below - *pixel) / 0.5;
    }
    fit.seen.covariance = J * covariance_.topLeftCorner<8, 8>() * J.transpose();
    if (!fit.seen.covariance.allFinite()) return std::nullopt;
    return fit;
  }

  const Light& light_;
  const Lens& camera_;
  const RayMap& rays_;
  const TagTarget& target_;
  Eigen::Vector2d along_x_, along_y_;
  Corners plane_;
  std::vector<Pixel> pixels_;
  Eigen::Vector2d middle_ = Eigen::Vector2d::Zero();  ///< ideal pixels
  double radius_ = 1;                                 ///< px, unit of the light's slope
  Parameters theta_ = Parameters::Zero();
  double scale_ = 1;
  Normal covariance_ = Normal::Zero();
};

}  // namespace

std::optional<TagFit> fitTag(const Light& light, const Lens& camera, const RayMap& rays,
                             const TagTarget& target, const Corners& start) {
  return Fitter(light, camera, rays, target).fit(start);
}

}  // namespace afterglow::calib
