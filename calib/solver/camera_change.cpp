#include "calib/solver/camera_change.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace afterglow::calib {
namespace {

/// Bounds in deviations of camera_infos: a change beyond the first is warned of, beyond the second
/// refused.
constexpr double kUnusual = 3, kImpossible = 12;

CameraVector parametersOf(const Lens& lens) {
  CameraVector p;
  p << lens.K(0, 0), lens.K(1, 1), lens.K(0, 2), lens.K(1, 2), lens.D[0], lens.D[1], lens.D[2],
      lens.D[3];
  return p;
}

/// d residuals of the prior / d parameters.
CameraMatrix priorRoot(const Lens& given) {
  const CameraDeviations usual = usualDeviations(given);
  CameraMatrix root = CameraMatrix::Zero();
  root(0, 0) = 0.5 / (given.K(0, 0) * usual.focal);
  root(0, 1) = 0.5 / (given.K(1, 1) * usual.focal);
  root(1, 0) = 1 / (given.K(0, 0) * usual.aspect);
  root(1, 1) = -1 / (given.K(1, 1) * usual.aspect);
  root(2, 2) = root(3, 3) = 1 / usual.center_px;
  for (Eigen::Index i = 0; i < 4; ++i) root(4 + i, 4 + i) = 1 / usual.D[std::size_t(i)];
  return root;
}

/// The limit that chi-square with so many degrees of freedom exceeds once in a thousand times:
/// Wilson and Hilferty, The Distribution of Chi-Square, 1931.
double chiSquareLimit(int degrees) {
  constexpr double kNormal = 3.0902;
  const double ninth = 2.0 / (9.0 * degrees);
  return degrees * std::pow(1 - ninth + kNormal * std::sqrt(ninth), 3);
}

/// If camera_info were right, the refined parameters would differ from it only by the errors of the
/// views. With the prior's deviations as units, the posterior covariance has eigenvalues l from 0
/// (the views determine all) to 1 (nothing), and such differences have the variance l (1 - l).
ChiSquare chiSquareOf(const Eigen::VectorXd& moved, const Eigen::MatrixXd& covariance,
                      const Eigen::MatrixXd& root) {
  constexpr double kTellsNothing = 0.98;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> axes(root * covariance * root.transpose());
  ChiSquare chi_square;
  int degrees = 0;
  for (Eigen::Index i = 0; i < moved.size(); ++i) {
    const double l = axes.eigenvalues()[i];
    if (!(l > 0 && l < kTellsNothing)) continue;
    const double along = axes.eigenvectors().col(i).dot(root * moved);
    chi_square.value += along * along / (l * (1 - l));
    ++degrees;
  }
  chi_square.limit = chiSquareLimit(std::max(1, degrees));
  return chi_square;
}

double largestMove_px(const Lens& from, const Lens& to) {
  constexpr int kSteps = 16;
  double largest = 0;
  for (int row = 0; row <= kSteps; ++row) {
    for (int column = 0; column <= kSteps; ++column) {
      const Eigen::Vector2d pixel(column * (from.width - 1.0) / kSteps,
                                  row * (from.height - 1.0) / kSteps);
      const auto ray = unproject(from, pixel);
      const auto moved = ray ? project(to, *ray) : std::nullopt;
      if (moved) largest = std::max(largest, (*moved - pixel).norm());
    }
  }
  return largest;
}

/// The largest of focal length and center, in deviations of camera_infos.
double deviationsOf(const Lens& given, const CameraChange& change) {
  const CameraDeviations usual = usualDeviations(given);
  return std::max(std::abs(change.focal) / usual.focal,
                  change.center_px.cwiseAbs().maxCoeff() / usual.center_px);
}

/// "fx is 0.20 % larger than its file says, center (+1.0, -0.9) px, up to 2.1 px in the picture"
std::string changeText(const CameraChange& change) {
  return fmt::format(
      "fx is {:.2f} % {} than its file says, center ({:+.1f}, {:+.1f}) px, up to {:.1f} px in the "
      "picture",
      100 * std::abs(change.focal), change.focal < 0 ? "smaller" : "larger", change.center_px.x(),
      change.center_px.y(), change.largest_px);
}

}  // namespace

CameraDeviations usualDeviations(const Lens& camera) {
  CameraDeviations usual;
  usual.center_px = 0.0025 * camera.width;
  if (camera.model == LensModel::Equidistant) {
    usual.D = {0.01, 0.02, 0.02, 0.01};
  } else {
    usual.D = {0.02, 0.05, 0.001, 0.001};
  }
  return usual;
}

void CameraChange::describe(const Lens& given, const Lens& refined) {
  focal = 0.5 * (refined.K(0, 0) / given.K(0, 0) + refined.K(1, 1) / given.K(1, 1)) - 1;
  center_px = (refined.K - given.K).col(2).head<2>();
  largest_px = largestMove_px(given, refined);
}

CameraChange cameraChange(const Lens& given, const Lens& refined, const CameraMatrix& covariance) {
  CameraChange change;
  change.describe(given, refined);
  const CameraVector moved = parametersOf(refined) - parametersOf(given);
  const CameraMatrix root = priorRoot(given);
  change.contradiction = chiSquareOf(moved, covariance, root);
  change.distortion_contradiction = chiSquareOf(
      moved.tail<4>(), covariance.bottomRightCorner<4, 4>(), root.bottomRightCorner<4, 4>());
  return change;
}

std::string fateName(CameraFate fate) {
  static const char* const kNames[] = {"agrees", "refined", "held"};
  return kNames[static_cast<int>(fate)];
}

std::string cameraText(const CameraChange& change) {
  switch (change.fate) {
    case CameraFate::Refined:
      return "the camera was refined: " + changeText(change);
    case CameraFate::Agrees:
      return "the camera's camera_info agrees with the pictures and was kept";
    case CameraFate::Held:
      break;
  }
  return "the camera was held as its camera_info has it: its own error is not in that";
}

std::vector<std::string> cameraRefusals(const Lens& given, const CameraChange& change) {
  if (!change.isContradicted() || !(deviationsOf(given, change) > kImpossible)) return {};
  return {"the camera is not the one its camera_info describes (" + changeText(change) +
          "): is the camera_info this camera's, at this resolution, zoom and focus? Calibrate the "
          "camera first"};
}

std::vector<std::string> cameraWarnings(const Lens& given, const CameraChange& change) {
  if (!change.isContradicted()) return {};
  if (change.fate == CameraFate::Held) {
    return {"the pictures contradict the camera_info, which was held fixed (" + changeText(change) +
            "): the errors stated leave that out; let the camera be refined, or calibrate it anew"};
  }
  if (!(deviationsOf(given, change) > kUnusual)) return {};
  return {"the camera_info is further off than a calibrated camera's is (" + changeText(change) +
          "): calibrate the camera anew, and do not use this camera_info elsewhere"};
}

}  // namespace afterglow::calib
