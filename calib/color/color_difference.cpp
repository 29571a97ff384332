#include "calib/color/color_difference.hpp"

#include <algorithm>
#include <cmath>

namespace afterglow::calib {
namespace {

/// Lightness and the like: a cube root, and a line where it would be too steep.
double labCurve(double share) {
  constexpr double kEdge = 6.0 / 29;
  return share > kEdge * kEdge * kEdge ? std::cbrt(share)
                                       : share / (3 * kEdge * kEdge) + 4.0 / 29;
}

double degrees(double radians) { return radians * 180 / M_PI; }
double radians(double degrees) { return degrees * M_PI / 180; }

/// 0 to 360; 0 for gray.
double hue(double a, double b) {
  if (a == 0 && b == 0) return 0;
  const double angle = degrees(std::atan2(b, a));
  return angle < 0 ? angle + 360 : angle;
}

double seventh(double chroma) {
  const double power = std::pow(chroma, 7);
  return std::sqrt(power / (power + std::pow(25.0, 7)));
}

/// Returns the way from one hue to the other, the short way; 0 if either is gray.
double hueStep(double from, double to, bool is_gray) {
  if (is_gray) return 0;
  const double step = to - from;
  return step > 180 ? step - 360 : step < -180 ? step + 360 : step;
}

double meanHue(double a, double b, bool is_gray) {
  if (is_gray) return a + b;
  if (std::abs(a - b) <= 180) return (a + b) / 2;
  return a + b < 360 ? (a + b + 360) / 2 : (a + b - 360) / 2;
}

}  // namespace

double lightOfSrgb(double coded) {
  return coded <= 0.04045 ? coded / 12.92 : std::pow((coded + 0.055) / 1.055, 2.4);
}

double srgbOfLight(double light) {
  return light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1 / 2.4) - 0.055;
}

Eigen::Vector3d labOf(const Eigen::Vector3d& light) {
  Eigen::Matrix3d to_xyz;  // IEC 61966-2-1
  to_xyz << 0.4124, 0.3576, 0.1805, 0.2126, 0.7152, 0.0722, 0.0193, 0.1192, 0.9505;
  const Eigen::Vector3d xyz = to_xyz * light, white = to_xyz.rowwise().sum();
  const double x = labCurve(xyz.x() / white.x()), y = labCurve(xyz.y() / white.y()),
               z = labCurve(xyz.z() / white.z());
  return {116 * y - 16, 500 * (x - y), 200 * (y - z)};
}

double colorDifference(const Eigen::Vector3d& lab_a, const Eigen::Vector3d& lab_b) {
  const double mean_ab = (lab_a.tail<2>().norm() + lab_b.tail<2>().norm()) / 2;
  const double stretch = 1.5 - 0.5 * seventh(mean_ab);
  const double a1 = stretch * lab_a.y(), a2 = stretch * lab_b.y();
  const double C1 = std::hypot(a1, lab_a.z()), C2 = std::hypot(a2, lab_b.z());
  const double h1 = hue(a1, lab_a.z()), h2 = hue(a2, lab_b.z());
  const bool is_gray = C1 * C2 == 0;
  const double dL = lab_b.x() - lab_a.x(), dC = C2 - C1;
  const double dH = 2 * std::sqrt(C1 * C2) * std::sin(radians(hueStep(h1, h2, is_gray) / 2));
  const double L = (lab_a.x() + lab_b.x()) / 2, C = (C1 + C2) / 2, h = meanHue(h1, h2, is_gray);
  const double T = 1 - 0.17 * std::cos(radians(h - 30)) + 0.24 * std::cos(radians(2 * h)) +
                   0.32 * std::cos(radians(3 * h + 6)) - 0.20 * std::cos(radians(4 * h - 63));
  const double turn = 30 * std::exp(-std::pow((h - 275) / 25, 2));
  const double L50 = (L - 50) * (L - 50);
  const double SL = 1 + 0.015 * L50 / std::sqrt(20 + L50), SC = 1 + 0.045 * C;
  const double SH = 1 + 0.015 * C * T;
  const double RT = -std::sin(radians(2 * turn)) * 2 * seventh(C);
  const double l = dL / SL, c = dC / SC, H = dH / SH;
  return std::sqrt(std::max(0.0, l * l + c * c + H * H + RT * c * H));
}

}  // namespace afterglow::calib
