#include "calib/lens.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace afterglow::calib {
namespace {

/// Pictures are at most so wide and high, px: a larger size is a mistake.
constexpr int kLargestSide = 16384;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// 0.6 degrees from the image plane: no lens sees rays beyond it.
constexpr double kLargestRadius = 100;

/// The radial part of Brown-Conrady, as functions of s = r^2: factor = N(s) / M(s).
struct Radial {
  double numerator, numerator_slope;
  double denominator, denominator_slope;

  Radial(const std::array<double, 8>& D, double s)
      : numerator(1 + s * (D[0] + s * (D[1] + s * D[4]))),
        numerator_slope(D[0] + s * (2 * D[1] + s * 3 * D[4])),
        denominator(1 + s * (D[5] + s * (D[6] + s * D[7]))),
        denominator_slope(D[5] + s * (2 * D[6] + s * 3 * D[7])) {}

  double factor() const { return numerator / denominator; }
  /// d factor / ds
  double factorSlope() const {
    return (numerator_slope * denominator - numerator * denominator_slope) /
           (denominator * denominator);
  }
  /// Returns true if the distorted radius r * factor grows with r here, on this side of any pole.
  bool grows(double s) const { return denominator > 0 && factor() + 2 * s * factorSlope() > 0; }
};

/// The slope of equidistantRadius.
double fisheyeSlope(const std::array<double, 8>& k, double angle) {
  const double s = angle * angle;
  return 1 + s * (3 * k[0] + s * (5 * k[1] + s * (7 * k[2] + s * 9 * k[3])));
}

Eigen::Vector2d distortFisheye(const Lens& lens, const Eigen::Vector2d& n) {
  const double radius = n.norm();
  return radius > 0 ? n * equidistantRadius(lens.D, std::atan(radius)) / radius : n;
}

/// Newton within the bracket that bisection keeps: the radius grows with the angle up to the fold.
std::optional<Eigen::Vector2d> undistortFisheye(const Lens& lens, const Eigen::Vector2d& d) {
  const double target = d.norm();
  if (!(target > 0)) return target == 0 ? std::optional<Eigen::Vector2d>(d) : std::nullopt;
  double low = 0, high = std::atan(lens.fold_radius);
  if (!(target <= equidistantRadius(lens.D, high))) return std::nullopt;
  double angle = std::min(target, high);
  for (int i = 0; i < 100; ++i) {
    const double error = equidistantRadius(lens.D, angle) - target;
    (error < 0 ? low : high) = angle;
    double next = angle - error / fisheyeSlope(lens.D, angle);
    if (!(next >= low && next <= high)) next = 0.5 * (low + high);
    if (std::abs(next - angle) < 1e-16) break;
    angle = next;
  }
  return Eigen::Vector2d(d * std::tan(angle) / target);
}

/// A distorted point, with its derivatives by the undistorted one and by D.
struct DistortSlope {
  Eigen::Vector2d at;
  Eigen::Matrix2d by_point;
  Eigen::Matrix<double, 2, 8> by_D;
};

DistortSlope fisheyeDistortSlope(const Lens& lens, const Eigen::Vector2d& n) {
  DistortSlope slope{n, Eigen::Matrix2d::Identity(), Eigen::Matrix<double, 2, 8>::Zero()};
  const double s = n.squaredNorm();
  if (s < 1e-16) return slope;
  const double radius = std::sqrt(s), angle = std::atan(radius);
  const double scale = equidistantRadius(lens.D, angle) / radius;
  slope.at = scale * n;
  const double growth = fisheyeSlope(lens.D, angle) / (1 + s);  // d distorted / d radius
  slope.by_point = scale * Eigen::Matrix2d::Identity() + (growth - scale) / s * n * n.transpose();
  double power = angle / radius;
  for (int i = 0; i < 4; ++i) slope.by_D.col(i) = n * (power *= angle * angle);
  return slope;
}

DistortSlope distortSlope(const Lens& lens, const Eigen::Vector2d& n) {
  if (lens.model == LensModel::Equidistant) return fisheyeDistortSlope(lens, n);
  const double s = n.squaredNorm(), x = n.x(), y = n.y(), p1 = lens.D[2], p2 = lens.D[3];
  const Radial radial(lens.D, s);
  const double factor = radial.factor(), factor_slope = 2 * radial.factorSlope();
  DistortSlope slope;
  slope.at = distort(lens, n);
  slope.by_point(0, 0) = factor + factor_slope * x * x + 2 * p1 * y + 6 * p2 * x;
  slope.by_point(0, 1) = slope.by_point(1, 0) = factor_slope * x * y + 2 * p1 * x + 2 * p2 * y;
  slope.by_point(1, 1) = factor + factor_slope * y * y + 6 * p1 * y + 2 * p2 * x;
  const double up = s / radial.denominator, down = -factor * up;
  slope.by_D.row(0) << x * up, x * up * s, 2 * x * y, s + 2 * x * x, x * up * s * s, x * down,
      x * down * s, x * down * s * s;
  slope.by_D.row(1) << y * up, y * up * s, s + 2 * y * y, 2 * x * y, y * up * s * s, y * down,
      y * down * s, y * down * s * s;
  return slope;
}

/// Undistorted radius whose radially distorted radius is `target`; the fold's if none is.
double undistortRadius(const Lens& lens, double target) {
  const auto distorted = [&](double r) { return r * Radial(lens.D, r * r).factor(); };
  double high = std::min(lens.fold_radius, 1.0);
  while (high < lens.fold_radius && distorted(high) < target && high < 1e6) {
    high = std::min(2 * high, lens.fold_radius);
  }
  double low = 0;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (distorted(middle) < target ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

/// Newton with step halving: near the fold a full step would jump across it.
std::optional<Eigen::Vector2d> undistort(const Lens& lens, const Eigen::Vector2d& distorted) {
  if (lens.model == LensModel::Equidistant) return undistortFisheye(lens, distorted);
  constexpr double kTolerance = 1e-12;
  const double radius = distorted.norm();
  Eigen::Vector2d n = distorted;
  if (radius > 0) n *= undistortRadius(lens, radius) / radius;
  Eigen::Vector2d residual = distort(lens, n) - distorted;
  for (int i = 0; i < 50 && residual.norm() > kTolerance; ++i) {
    const Eigen::Vector2d step = distortSlope(lens, n).by_point.inverse() * residual;
    double scale = 1;
    Eigen::Vector2d next = n - step, next_residual = distort(lens, next) - distorted;
    while (!(next_residual.norm() < residual.norm()) && scale > 1e-6) {
      scale *= 0.5;
      next = n - scale * step;
      next_residual = distort(lens, next) - distorted;
    }
    if (!(next_residual.norm() < residual.norm())) break;
    n = next;
    residual = next_residual;
  }
  // Rounding at large coordinates keeps the residual above the tolerance; 1e-9 is still < 1e-5 px.
  if (!(residual.norm() <= 1e-9) || n.norm() > lens.fold_radius) return std::nullopt;
  return n;
}

std::string text(double value) {
  if (!std::isfinite(value)) return std::isnan(value) ? "NaN" : "infinity";
  return fmt::format("{:f}", value);
}

bool isRational(const Lens& lens) {
  return std::any_of(lens.D.begin() + 5, lens.D.end(), [](double d) { return d != 0; });
}

constexpr double kSpacing_px = 4;
constexpr double kNoRay = std::numeric_limits<double>::quiet_NaN();

}  // namespace

std::optional<LensModel> lensModelNamed(const std::string& distortion_model) {
  const std::string& name = distortion_model;
  if (name == "plumb_bob" || name == "rational_polynomial") return LensModel::BrownConrady;
  if (name == "equidistant" || name == "fisheye") return LensModel::Equidistant;
  return std::nullopt;
}

std::vector<double> usedDistortion(const std::string& distortion_model, std::vector<double> D) {
  const bool is_plumb_bob = distortion_model == "plumb_bob";
  if (!lensModelNamed(distortion_model)) return D;
  const std::size_t most = is_plumb_bob ? 5 : distortion_model == "rational_polynomial" ? 8 : 4;
  const std::string has = distortion_model + " has " + (is_plumb_bob ? "4 or " : "") +
                          std::to_string(most) + " numbers, found " + std::to_string(D.size());
  if (D.size() > most) {
    const auto rest = D.begin() + static_cast<std::ptrdiff_t>(most);
    if (std::any_of(rest, D.end(), [](double d) { return d != 0; })) {
      throw std::invalid_argument(has + ", and those beyond are not all 0");
    }
    D.resize(most);
  }
  const bool is_short = is_plumb_bob && (D.empty() || D.size() == 4);
  if (D.size() != most && !is_short) throw std::invalid_argument(has);
  return D;
}

std::string distortionModel(const Lens& lens) {
  if (lens.model == LensModel::Equidistant) return "equidistant";
  return isRational(lens) ? "rational_polynomial" : "plumb_bob";
}

std::vector<double> distortionCoefficients(const Lens& lens) {
  const int count = lens.model == LensModel::Equidistant ? 4 : isRational(lens) ? 8 : 5;
  return {lens.D.begin(), lens.D.begin() + count};
}

std::vector<std::string> lensViolations(int width, int height, const Eigen::Matrix3d& K,
                                        const std::vector<double>& D, LensModel model) {
  std::vector<std::string> found;
  if (width <= 0 || height <= 0) {
    found.push_back(
        fmt::format("image size {} x {}: expected at least 1 x 1 pixels", width, height));
  }
  if (width > kLargestSide || height > kLargestSide) {
    found.push_back(fmt::format("image size {} x {}: expected at most {} pixels a side", width,
                                height, kLargestSide));
  }
  if (!K.allFinite()) found.push_back("K holds a number that is not finite");
  if (!(K(0, 0) > 0)) found.push_back("K[0] (fx) is " + text(K(0, 0)) + ": expected > 0");
  if (!(K(1, 1) > 0)) found.push_back("K[4] (fy) is " + text(K(1, 1)) + ": expected > 0");
  if (K(1, 0) != 0) found.push_back("K[3] is " + text(K(1, 0)) + ": expected 0");
  if (K(2, 0) != 0 || K(2, 1) != 0 || K(2, 2) != 1) {
    found.push_back("K's last row is " + text(K(2, 0)) + ", " + text(K(2, 1)) + ", " +
                    text(K(2, 2)) + ": expected 0, 0, 1");
  }
  const bool is_fisheye = model == LensModel::Equidistant;
  const bool fits = D.size() == 4 || (!is_fisheye && (D.empty() || D.size() == 5 || D.size() == 8));
  if (!fits) {
    found.push_back("D has " + std::to_string(D.size()) + " numbers: expected " +
                    (is_fisheye ? "4 for an equidistant lens" : "0, 4, 5 or 8"));
  }
  if (!std::all_of(D.begin(), D.end(), [](double d) { return std::isfinite(d); })) {
    found.push_back("D holds a number that is not finite");
  }
  return found;
}

Lens makeLens(int width, int height, const Eigen::Matrix3d& K, const std::vector<double>& D,
              LensModel model) {
  const std::vector<std::string> violations = lensViolations(width, height, K, D, model);
  if (!violations.empty()) {
    std::string message = "unusable lens: ";
    for (const std::string& violation : violations) {
      if (&violation != &violations.front()) message += "; ";
      message += violation;
    }
    throw std::invalid_argument(message);
  }
  Lens lens;
  lens.width = width;
  lens.height = height;
  lens.K = K;
  lens.model = model;
  std::copy(D.begin(), D.end(), lens.D.begin());
  lens.fold_radius = foldRadius(lens);
  return lens;
}

double foldRadius(const Lens& lens) {
  const bool is_fisheye = lens.model == LensModel::Equidistant;
  const auto grows = [&](double r) {
    return is_fisheye ? fisheyeSlope(lens.D, std::atan(r)) > 0 : Radial(lens.D, r * r).grows(r * r);
  };
  double low = 0, high = 0;
  do {
    low = high;
    high += std::max(1e-3, 1e-3 * high);
    if (high > kLargestRadius) return is_fisheye ? kLargestRadius : kInfinity;
  } while (grows(high));
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (grows(middle) ? low : high) = middle;
  }
  return low;
}

Eigen::Vector2d distort(const Lens& lens, const Eigen::Vector2d& undistorted) {
  if (lens.model == LensModel::Equidistant) return distortFisheye(lens, undistorted);
  const double factor = radialFactor(lens.D, undistorted.squaredNorm());
  const auto [x, y] = distorted(undistorted.x(), undistorted.y(), factor, lens.D[2], lens.D[3]);
  return {x, y};
}

PixelSlope pixelSlope(const Lens& lens, const Eigen::Vector2d& ray) {
  const DistortSlope distorted = distortSlope(lens, ray);
  const double x = distorted.at.x(), y = distorted.at.y();
  const Eigen::Matrix2d focal = lens.K.topLeftCorner<2, 2>();
  PixelSlope slope;
  slope.pixel = focal * distorted.at + lens.K.topRightCorner<2, 1>();
  slope.by_ray = focal * distorted.by_point;
  slope.by_lens.leftCols<5>() << x, 0, 1, 0, y, 0, y, 0, 1, 0;
  slope.by_lens.rightCols<8>() = focal * distorted.by_D;
  return slope;
}

std::optional<Eigen::Vector2d> project(const Lens& lens, const Eigen::Vector3d& p_optical) {
  if (!(p_optical.z() > 0)) return std::nullopt;
  const Eigen::Vector2d n = p_optical.head<2>() / p_optical.z();
  if (!(n.norm() <= lens.fold_radius)) return std::nullopt;
  const Eigen::Vector2d d = distort(lens, n);
  return Eigen::Vector2d(lens.K(0, 0) * d.x() + lens.K(0, 1) * d.y() + lens.K(0, 2),
                         lens.K(1, 1) * d.y() + lens.K(1, 2));
}

std::optional<Eigen::Vector3d> unproject(const Lens& lens, const Eigen::Vector2d& pixel) {
  Eigen::Vector2d d;
  d.y() = (pixel.y() - lens.K(1, 2)) / lens.K(1, 1);
  d.x() = (pixel.x() - lens.K(0, 2) - lens.K(0, 1) * d.y()) / lens.K(0, 0);
  const std::optional<Eigen::Vector2d> n = undistort(lens, d);
  if (!n) return std::nullopt;
  return Eigen::Vector3d(n->x(), n->y(), 1);
}

RayMap::RayMap(const Lens& lens)
    : columns_(static_cast<int>(std::ceil(lens.width / kSpacing_px)) + 3),
      rows_(static_cast<int>(std::ceil(lens.height / kSpacing_px)) + 3) {
  rays_.reserve(std::size_t(columns_) * std::size_t(rows_));
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column) {
      const auto ray = unproject(lens, kSpacing_px * Eigen::Vector2d(column - 1, row - 1));
      rays_.push_back(ray ? Eigen::Vector2d(ray->head<2>()) : Eigen::Vector2d(kNoRay, kNoRay));
    }
  }
}

Eigen::Vector2d RayMap::ray(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector2d at = pixel / kSpacing_px + Eigen::Vector2d(1, 1);
  const int column = std::clamp(static_cast<int>(std::floor(at.x())), 0, columns_ - 2);
  const int row = std::clamp(static_cast<int>(std::floor(at.y())), 0, rows_ - 2);
  const double a = at.x() - column, b = at.y() - row;
  const auto grid = [&](int r, int c) -> const Eigen::Vector2d& {
    return rays_[std::size_t(r) * std::size_t(columns_) + std::size_t(c)];
  };
  return (1 - b) * ((1 - a) * grid(row, column) + a * grid(row, column + 1)) +
         b * ((1 - a) * grid(row + 1, column) + a * grid(row + 1, column + 1));
}

}  // namespace afterglow::calib
