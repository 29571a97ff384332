#include "calib/solver/refine.hpp"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

namespace afterglow::calib {
namespace {

// Blocks of parameters as Ceres has them.
constexpr int kLensSize = 13;  // fx fy cx cy skew, then D
constexpr int kPoseSize = 6;   // rotation vector, translation
using LensBlock = std::array<double, kLensSize>;
using PoseBlock = std::array<double, kPoseSize>;

LensBlock blockOf(const Lens& lens) {
  LensBlock block{lens.K(0, 0), lens.K(1, 1), lens.K(0, 2), lens.K(1, 2), lens.K(0, 1)};
  std::copy(lens.D.begin(), lens.D.end(), block.begin() + 5);
  return block;
}

Lens lensOf(const LensBlock& block, const Lens& like) {
  Lens lens = like;
  lens.K << block[0], block[4], block[2], 0, block[1], block[3], 0, 0, 1;
  std::copy(block.begin() + 5, block.end(), lens.D.begin());
  lens.fold_radius = foldRadius(lens);
  return lens;
}

PoseBlock blockOf(const Eigen::Isometry3d& T) {
  PoseBlock block;
  const Eigen::Matrix3d R = T.linear();
  ceres::RotationMatrixToAngleAxis(R.data(), block.data());
  Eigen::Map<Eigen::Vector3d>(block.data() + 3) = T.translation();
  return block;
}

Eigen::Isometry3d isometryOf(const PoseBlock& block) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  Eigen::Matrix3d R;
  ceres::AngleAxisToRotationMatrix(block.data(), R.data());
  T.linear() = R;
  T.translation() = Eigen::Map<const Eigen::Vector3d>(block.data() + 3);
  return T;
}

/// OpenCV's camera model on z = 1 coordinates.
template <typename T>
void distortT(const T* D, const T& x, const T& y, T* dx, T* dy) {
  const T s = x * x + y * y;
  const T radial =
      (1.0 + s * (D[0] + s * (D[1] + s * D[4]))) / (1.0 + s * (D[5] + s * (D[6] + s * D[7])));
  *dx = x * radial + 2.0 * D[2] * x * y + D[3] * (s + 2.0 * x * x);
  *dy = y * radial + D[2] * (s + 2.0 * y * y) + 2.0 * D[3] * x * y;
}

template <typename T>
void projectT(const T* lens, const T& x, const T& y, T* u, T* v) {
  T dx, dy;
  distortT(lens + 5, x, y, &dx, &dy);
  *u = lens[0] * dx + lens[4] * dy + lens[2];
  *v = lens[1] * dy + lens[3];
}

/// Inverse of projectT by fixed-point iteration; converges for every lens whose image does not
/// fold.
template <typename T>
void unprojectT(const T* lens, double u, double v, T* x, T* y) {
  const T dy = (v - lens[3]) / lens[1];
  const T dx = (u - lens[2] - lens[4] * dy) / lens[0];
  *x = dx;
  *y = dy;
  for (int i = 0; i < 25; ++i) {
    T ex, ey;
    distortT(lens + 5, *x, *y, &ex, &ey);
    *x -= ex - dx;
    *y -= ey - dy;
  }
}

/// Whitened: errors times the inverse root of their covariance.
template <typename T>
void whiten(const Matrix8& root, const T* error, T* residual) {
  for (int row = 0; row < 8; ++row) {
    residual[row] = T(0);
    for (int column = 0; column <= row; ++column)
      residual[row] += root(row, column) * error[column];
  }
}

/// Lower triangular W with W * C * W^T = 1.
Matrix8 whitening(const Matrix8& covariance) {
  const Matrix8 L = covariance.llt().matrixL();
  return L.triangularView<Eigen::Lower>().solve(Matrix8::Identity());
}

/// Printed corners: camera pixels against where pose and camera put them.
struct PrintedCost {
  const Sighting* tag;
  Matrix8 root;
  template <typename T>
  bool operator()(const T* camera, const T* board, T* residual) const {
    T error[8];
    for (std::size_t i = 0; i < 4; ++i) {
      const T p_board[3] = {T(tag->target[i].x()), T(tag->target[i].y()), T(0)};
      cornerError(i, camera, board, p_board, error + 2 * i);
    }
    whiten(root, error, residual);
    return true;
  }
  template <typename T>
  void cornerError(std::size_t i, const T* camera, const T* board, const T* p_board,
                   T* error) const {
    T p[3], u, v;
    ceres::AngleAxisRotatePoint(board, p_board, p);
    for (int k = 0; k < 3; ++k) p[k] += board[3 + k];
    projectT(camera, T(p[0] / p[2]), T(p[1] / p[2]), &u, &v);
    error[0] = tag->camera_px[i].x() - u;
    error[1] = tag->camera_px[i].y() - v;
  }
};

/// The same on a sheet stretched by 1 + stretch along its x axis.
struct StretchedCost {
  PrintedCost cost;
  template <typename T>
  bool operator()(const T* camera, const T* board, const T* stretch, T* residual) const {
    T error[8];
    for (std::size_t i = 0; i < 4; ++i) {
      const T p_board[3] = {cost.tag->target[i].x() * (1.0 + stretch[0]),
                            T(cost.tag->target[i].y()), T(0)};
      cost.cornerError(i, camera, board, p_board, error + 2 * i);
    }
    whiten(cost.root, error, residual);
    return true;
  }
};

/// Projected corners: camera ray, board's plane, projector, against the pattern's pixels.
struct ProjectedCost {
  const Sighting* tag;
  Matrix8 root;  ///< of the errors in projector pixels
  bool free_camera;
  Eigen::Matrix3d R0;  ///< T_camera_projector is R0 * exp(w), t
  template <typename T>
  bool operator()(const T* camera, const T* board, const T* lens, const T* pose,
                  T* residual) const {
    T normal[3];
    const T z_axis[3] = {T(0), T(0), T(1)};
    ceres::AngleAxisRotatePoint(board, z_axis, normal);
    const T offset = normal[0] * board[3] + normal[1] * board[4] + normal[2] * board[5];
    const T back[3] = {-pose[0], -pose[1], -pose[2]};
    T error[8];
    for (std::size_t i = 0; i < 4; ++i) {
      T x = T(tag->rays[i].x()), y = T(tag->rays[i].y());
      if (free_camera) unprojectT(camera, tag->camera_px[i].x(), tag->camera_px[i].y(), &x, &y);
      const T depth = offset / (normal[0] * x + normal[1] * y + normal[2]);
      const T d[3] = {x * depth - pose[3], y * depth - pose[4], depth - pose[5]};
      T turned[3], p[3];
      for (int k = 0; k < 3; ++k) turned[k] = R0(0, k) * d[0] + R0(1, k) * d[1] + R0(2, k) * d[2];
      ceres::AngleAxisRotatePoint(back, turned, p);
      T u, v;
      projectT(lens, T(p[0] / p[2]), T(p[1] / p[2]), &u, &v);
      error[2 * i] = u - tag->target[i].x();
      error[2 * i + 1] = v - tag->target[i].y();
    }
    whiten(root, error, residual);
    return true;
  }
};

/// What is known of projectors before any is measured, as standard deviations: without it high
/// distortion terms explode where no board was held.
struct LensPrior {
  double aspect;
  template <typename T>
  bool operator()(const T* lens, T* residual) const {
    constexpr double kDeviations[8] = {0.5, 0.3, 0.003, 0.003, 0.05, 0.3, 0.1, 0.03};
    residual[0] = (lens[0] / lens[1] - 1.0) / aspect;
    for (int i = 0; i < 8; ++i) residual[1 + i] = lens[5 + i] / kDeviations[i];
    return true;
  }
};

/// d projector pixel / d camera pixel at a corner, through the board's plane.
Eigen::Matrix2d pixelTransfer(const ProjectorModel& model, const ViewEvidence& view,
                              const Eigen::Vector2d& ray) {
  const Rigid<Projector, Camera> T_projector_camera = model.T_camera_projector.inverse();
  const auto pixel = [&](const Eigen::Vector2d& at) -> Eigen::Vector2d {
    const Eigen::Vector3d p = T_projector_camera * onBoard(at, view.T_camera_board);
    return (model.projector.K * distort(model.projector, p.hnormalized()).homogeneous()).head<2>();
  };
  // A tenth of a camera pixel. The camera's own distortion changes its scale by a few per cent
  // only.
  const double step = 0.1 / model.camera.K(0, 0);
  Eigen::Matrix2d J;
  for (int k = 0; k < 2; ++k) {
    const Eigen::Vector2d by = step * Eigen::Vector2d::Unit(k);
    J.col(k) = (pixel(ray + by) - pixel(ray - by)) / (2 * 0.1);
  }
  return J;
}

Matrix8 projectorCovariance(const ProjectorModel& model, const ViewEvidence& view,
                            const Sighting& tag) {
  Matrix8 J = Matrix8::Zero();
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Index k = 2 * Eigen::Index(i);
    J.block<2, 2>(k, k) = pixelTransfer(model, view, tag.rays[i]);
  }
  return J * tag.covariance * J.transpose();
}

/// A problem with the memory its parameters live in.
class Bundle {
 public:
  Bundle(const ProjectorModel& model, std::vector<ViewEvidence>& views,
         const RefineSettings& settings)
      : model_(model),
        views_(views),
        settings_(settings),
        lens_(blockOf(model.projector)),
        camera_(blockOf(model.camera)) {
    Eigen::Map<Eigen::Vector3d>(pose_.data()).setZero();
    Eigen::Map<Eigen::Vector3d>(pose_.data() + 3) = model.T_camera_projector.matrix().translation();
    boards_.resize(views.size());
    for (std::size_t i = 0; i < views.size(); ++i) {
      if (views[i].is_used) addView(i);
    }
    hold();
  }

  void solve() {
    ceres::Solver::Options options;
    options.linear_solver_type =
        settings_.free_boards ? ceres::SPARSE_NORMAL_CHOLESKY : ceres::DENSE_QR;
    options.max_num_iterations = settings_.iterations;
    options.function_tolerance = 1e-10;
    options.parameter_tolerance = 1e-11;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem_, &summary);
    if (!summary.IsSolutionUsable()) {
      throw CalibrationRefused(
          {"the solver found no projector that explains the views (" + summary.message + ")"});
    }
  }

  /// Back into values.
  void store(ProjectorModel& model) {
    model.projector = lensOf(lens_, model.projector);
    if (settings_.free_camera) model.camera = lensOf(camera_, model.camera);
    Eigen::Isometry3d T = model.T_camera_projector.matrix();
    Eigen::Matrix3d turn;
    ceres::AngleAxisToRotationMatrix(pose_.data(), turn.data());
    T.linear() = T.linear() * turn;
    T.translation() = Eigen::Map<const Eigen::Vector3d>(pose_.data() + 3);
    model.T_camera_projector = Rigid<Camera, Projector>(T);
    for (std::size_t i = 0; i < views_.size(); ++i) {
      if (views_[i].is_used) {
        views_[i].T_camera_board = Rigid<Camera, Surface>(isometryOf(boards_[i]));
      }
    }
  }

  /// Of lens (13) and pose (6).
  Eigen::MatrixXd covariance() {
    ceres::Covariance::Options options;
    options.algorithm_type = ceres::SPARSE_QR;
    options.apply_loss_function = true;
    ceres::Covariance covariance(options);
    const std::vector<const double*> blocks{lens_.data(), pose_.data()};
    if (!covariance.Compute(blocks, &problem_)) {
      throw CalibrationRefused(
          {"the views leave the projector undetermined: tilt the board more, and differently"});
    }
    Eigen::Matrix<double, kLensSize + kPoseSize, kLensSize + kPoseSize, Eigen::RowMajor> result;
    covariance.GetCovarianceMatrix(blocks, result.data());
    return result;
  }

 private:
  void addView(std::size_t index) {
    ViewEvidence& view = views_[index];
    PoseBlock& board = boards_[index];
    board = blockOf(view.T_camera_board.matrix());
    const double printed_2 = model_.printed_scale * model_.printed_scale;
    const double projected_2 = model_.projected_scale * model_.projected_scale;
    if (settings_.free_boards || settings_.free_camera) {
      for (const Sighting& tag : view.printed) {
        problem_.AddResidualBlock(
            new ceres::AutoDiffCostFunction<PrintedCost, 8, kLensSize, kPoseSize>(
                new PrintedCost{&tag, whitening(tag.covariance * printed_2)}),
            loss(), camera_.data(), board.data());
      }
    }
    for (const Sighting& tag : view.projected) {
      const Matrix8 covariance = projectorCovariance(model_, view, tag) * projected_2;
      if (!covariance.allFinite()) continue;
      problem_.AddResidualBlock(
          new ceres::AutoDiffCostFunction<ProjectedCost, 8, kLensSize, kPoseSize, kLensSize,
                                          kPoseSize>(
              new ProjectedCost{&tag, whitening(covariance), settings_.free_camera,
                                model_.T_camera_projector.matrix().linear()}),
          loss(), camera_.data(), board.data(), lens_.data(), pose_.data());
    }
    if (!settings_.free_boards && problem_.HasParameterBlock(board.data())) {
      problem_.SetParameterBlockConstant(board.data());
    }
  }

  /// On the norm of the eight whitened errors of a tag.
  ceres::LossFunction* loss() const {
    return new ceres::CauchyLoss(settings_.robust_deviations * std::sqrt(8.0));
  }

  void hold() {
    problem_.AddResidualBlock(new ceres::AutoDiffCostFunction<LensPrior, 9, kLensSize>(
                                  new LensPrior{settings_.free_skew ? 1.0 : 0.01}),
                              nullptr, lens_.data());
    std::vector<int> held;
    if (!settings_.free_skew) held.push_back(4);
    if (!settings_.free_rational) held.insert(held.end(), {10, 11, 12});
    if (!held.empty()) {
      problem_.SetManifold(lens_.data(), new ceres::SubsetManifold(kLensSize, held));
    }
    if (!problem_.HasParameterBlock(camera_.data())) return;
    if (settings_.free_camera) {
      problem_.SetManifold(camera_.data(),
                           new ceres::SubsetManifold(kLensSize, {4, 9, 10, 11, 12}));
    } else {
      problem_.SetParameterBlockConstant(camera_.data());
    }
  }

  const ProjectorModel& model_;
  std::vector<ViewEvidence>& views_;
  RefineSettings settings_;
  ceres::Problem problem_;
  LensBlock lens_, camera_;
  PoseBlock pose_;
  std::vector<PoseBlock> boards_;
};

double deviationsOf(const Vector8& error, const Matrix8& covariance, double scale) {
  return (whitening(covariance) * error).norm() / (std::sqrt(8.0) * scale);
}

constexpr double kOutlierDeviations = 6;

/// NaN, from what cannot be projected, counts as infinite.
double middleOf(std::vector<double>& values) {
  for (double& value : values) {
    if (std::isnan(value)) value = std::numeric_limits<double>::infinity();
  }
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

void refine(ProjectorModel& model, std::vector<ViewEvidence>& views,
            const RefineSettings& settings) {
  Bundle bundle(model, views, settings);
  bundle.solve();
  bundle.store(model);
}

ProjectorEstimate estimateOf(const ProjectorModel& model, std::vector<ViewEvidence>& views,
                             const RefineSettings& settings) {
  ProjectorEstimate estimate;
  estimate.projector = model.projector;
  estimate.T_camera_projector = model.T_camera_projector;
  const Eigen::MatrixXd full = Bundle(model, views, settings).covariance();
  // Skew, number 4 there, is not a parameter of ours.
  std::array<Eigen::Index, kCalibrationParameters> from;
  for (Eigen::Index i = 0; i < kCalibrationParameters; ++i)
    from[std::size_t(i)] = i < 4 ? i : i + 1;
  for (Eigen::Index row = 0; row < kCalibrationParameters; ++row) {
    for (Eigen::Index column = 0; column < kCalibrationParameters; ++column) {
      estimate.covariance(row, column) = full(from[std::size_t(row)], from[std::size_t(column)]);
    }
  }
  return estimate;
}

void refineBoardPose(const ProjectorModel& model, ViewEvidence& view) {
  LensBlock camera = blockOf(model.camera);
  PoseBlock board = blockOf(view.T_camera_board.matrix());
  ceres::Problem problem;
  for (const Sighting& tag : view.printed) {
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<PrintedCost, 8, kLensSize, kPoseSize>(
                                 new PrintedCost{&tag, whitening(tag.covariance)}),
                             new ceres::CauchyLoss(4 * model.printed_scale * std::sqrt(8.0)),
                             camera.data(), board.data());
  }
  if (view.printed.empty()) return;
  problem.SetParameterBlockConstant(camera.data());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  view.T_camera_board = Rigid<Camera, Surface>(isometryOf(board));
}

PrintStretch printStretch(const ProjectorModel& model, const std::vector<ViewEvidence>& views) {
  LensBlock camera = blockOf(model.camera);
  std::vector<PoseBlock> boards;
  boards.reserve(views.size());
  double stretch = 0;
  ceres::Problem problem;
  for (const ViewEvidence& view : views) {
    if (!view.is_used) continue;
    boards.push_back(blockOf(view.T_camera_board.matrix()));
    for (const Sighting& tag : view.printed) {
      const PrintedCost cost{&tag,
                             whitening(tag.covariance * model.printed_scale * model.printed_scale)};
      problem.AddResidualBlock(
          new ceres::AutoDiffCostFunction<StretchedCost, 8, kLensSize, kPoseSize, 1>(
              new StretchedCost{cost}),
          new ceres::CauchyLoss(4 * std::sqrt(8.0)), camera.data(), boards.back().data(), &stretch);
    }
  }
  problem.SetParameterBlockConstant(camera.data());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  ceres::Covariance covariance{ceres::Covariance::Options()};
  double variance = 0;
  if (covariance.Compute({&stretch}, &problem)) {
    covariance.GetCovarianceBlock(&stretch, &stretch, &variance);
  }
  return {stretch, std::sqrt(variance)};
}

PixelShape pixelShape(const ProjectorModel& model, const std::vector<ViewEvidence>& views) {
  ProjectorModel free = model;
  std::vector<ViewEvidence> moved = views;
  RefineSettings settings;
  settings.free_skew = true;
  refine(free, moved, settings);
  const Eigen::MatrixXd covariance = Bundle(free, moved, settings).covariance();
  PixelShape shape;
  const double fx = free.projector.K(0, 0), fy = free.projector.K(1, 1);
  shape.aspect = fx / fy;
  const Eigen::Vector2d slope(1 / fy, -fx / (fy * fy));
  const Eigen::Matrix2d focal = covariance.topLeftCorner<2, 2>();
  shape.aspect_sigma = std::sqrt(slope.dot(focal * slope));
  shape.skew_rad = std::atan(free.projector.K(0, 1) / fy);
  shape.skew_sigma_rad = std::sqrt(covariance(4, 4)) / fy;
  return shape;
}

bool isOutlier(const TagError& error) { return !(error.deviations < kOutlierDeviations); }

TagError printedError(const ProjectorModel& model, const ViewEvidence& view, const Sighting& tag) {
  TagError result;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto pixel =
        project(model.camera,
                view.T_camera_board * Eigen::Vector3d(tag.target[i].x(), tag.target[i].y(), 0));
    result.error.segment<2>(2 * Eigen::Index(i)) =
        pixel ? Eigen::Vector2d(tag.camera_px[i] - *pixel)
              : Eigen::Vector2d(Eigen::Vector2d::Constant(std::nan("")));
  }
  result.deviations = deviationsOf(result.error, tag.covariance, model.printed_scale);
  return result;
}

TagError projectedError(const ProjectorModel& model, const ViewEvidence& view,
                        const Sighting& tag) {
  TagError result;
  const Rigid<Projector, Camera> T_projector_camera = model.T_camera_projector.inverse();
  for (std::size_t i = 0; i < 4; ++i) {
    const auto pixel =
        project(model.projector, T_projector_camera * onBoard(tag.rays[i], view.T_camera_board));
    result.error.segment<2>(2 * Eigen::Index(i)) =
        pixel ? Eigen::Vector2d(*pixel - tag.target[i])
              : Eigen::Vector2d(Eigen::Vector2d::Constant(std::nan("")));
  }
  result.deviations =
      deviationsOf(result.error, projectorCovariance(model, view, tag), model.projected_scale);
  return result;
}

namespace {

struct Deviations {
  std::vector<double> printed, projected;
};

Deviations deviationsOf(const ProjectorModel& model, const std::vector<ViewEvidence>& views) {
  Deviations all;
  for (const ViewEvidence& view : views) {
    if (!view.is_used) continue;
    for (const Sighting& tag : view.printed) {
      all.printed.push_back(printedError(model, view, tag).deviations);
    }
    for (const Sighting& tag : view.projected) {
      all.projected.push_back(projectedError(model, view, tag).deviations);
    }
  }
  return all;
}

double rootMeanSquare(const std::vector<double>& deviations) {
  double sum = 0;
  int count = 0;
  for (double one : deviations) {
    if (!(one < kOutlierDeviations)) continue;
    sum += one * one;
    ++count;
  }
  return count > 0 ? std::max(1.0, std::sqrt(sum / count)) : 1;
}

}  // namespace

void measureScales(ProjectorModel& model, const std::vector<ViewEvidence>& views) {
  model.printed_scale = model.projected_scale = 1;
  Deviations all = deviationsOf(model, views);
  // The middle of a chi with eight degrees of freedom, per degree, is 0.958.
  constexpr double kMiddle = 0.958;
  constexpr double kLeast = 1e-3;
  if (!all.printed.empty()) {
    model.printed_scale = std::max(middleOf(all.printed) / kMiddle, kLeast);
  }
  if (!all.projected.empty()) {
    model.projected_scale = std::max(middleOf(all.projected) / kMiddle, kLeast);
  }
}

void widenScales(ProjectorModel& model, const std::vector<ViewEvidence>& views) {
  const Deviations all = deviationsOf(model, views);
  model.printed_scale *= rootMeanSquare(all.printed);
  model.projected_scale *= rootMeanSquare(all.projected);
}

}  // namespace afterglow::calib
