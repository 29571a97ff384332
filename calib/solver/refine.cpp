#include "calib/solver/refine.hpp"

#include <ceres/ceres.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/solver/costs.hpp"

namespace afterglow::calib {
namespace {

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

/// Holds the camera's parameters that are not estimated, and adds the prior of the others.
void holdCamera(ceres::Problem& problem, LensBlock& camera, const ProjectorModel& model,
                const RefineSettings& settings) {
  if (!settings.free_camera) return problem.SetParameterBlockConstant(camera.data());
  std::vector<int> held{4, 9, 10, 11, 12};
  if (!settings.free_camera_distortion) held.insert(held.end(), {5, 6, 7, 8});
  problem.SetManifold(camera.data(), new ceres::SubsetManifold(kLensSize, held));
  problem.AddResidualBlock(
      new ceres::AutoDiffCostFunction<CameraPrior, kCameraParameters, kLensSize>(
          new CameraPrior{blockOf(model.camera_info), usualDeviations(model.camera_info)}),
      nullptr, camera.data());
}

/// A Ceres problem with the memory of its parameters.
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

  /// Copies the parameters back into model and views.
  void store(ProjectorModel& model) {
    model.projector = lensOf(lens_, model.projector);
    if (settings_.free_camera) {
      model.camera = lensOf(camera_, model.camera);
      for (ViewEvidence& view : views_) setRays(view, model.camera);
    }
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
    return covarianceOf({lens_.data(), pose_.data()}, kLensSize + kPoseSize);
  }
  Eigen::MatrixXd cameraCovariance() { return covarianceOf({camera_.data()}, kLensSize); }

 private:
  Eigen::MatrixXd covarianceOf(const std::vector<const double*>& blocks, int size) {
    ceres::Covariance::Options options;
    options.algorithm_type = ceres::SPARSE_QR;
    options.apply_loss_function = true;
    ceres::Covariance covariance(options);
    // Ceres ends the program when asked for the covariance of a block that is in no equation.
    const bool is_known = std::all_of(blocks.begin(), blocks.end(), [&](const double* block) {
      return problem_.HasParameterBlock(block);
    });
    if (!is_known || !covariance.Compute(blocks, &problem_)) {
      throw CalibrationRefused(
          {"the views leave the projector undetermined: tilt the board more, and differently"});
    }
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> result(size, size);
    covariance.GetCovarianceMatrix(blocks, result.data());
    return result;
  }

  void addView(std::size_t index) {
    ViewEvidence& view = views_[index];
    PoseBlock& board = boards_[index];
    board = blockOf(view.T_camera_board.matrix());
    const double printed_2 = model_.printed_scale * model_.printed_scale;
    const double projected_2 = model_.projected_scale * model_.projected_scale;
    for (const Sighting& tag : view.printed) {
      addPrinted({&tag, whitening(tag.covariance * printed_2), model_.camera.model}, board);
    }
    for (const Sighting& tag : view.projected) {
      const Matrix8 covariance = projectorCovariance(model_, view, tag) * projected_2;
      if (!covariance.allFinite()) continue;
      addProjected({&tag, whitening(covariance), model_.T_camera_projector.matrix().linear(),
                    model_.camera.model},
                   board, view);
    }
    if (!settings_.free_boards && problem_.HasParameterBlock(board.data())) {
      problem_.SetParameterBlockConstant(board.data());
    }
  }

  template <typename Cost, int... kSizes, typename... Blocks>
  void add(Cost* cost, Blocks*... blocks) {
    problem_.AddResidualBlock(new ceres::AutoDiffCostFunction<Cost, 8, kSizes...>(cost), loss(),
                              blocks...);
  }

  void addPrinted(const PrintedCost& cost, PoseBlock& board) {
    if (settings_.free_camera) {
      add<PrintedCost, kLensSize, kPoseSize>(new PrintedCost(cost), camera_.data(), board.data());
    } else if (settings_.free_boards) {
      add<PrintedKnownCameraCost, kPoseSize>(new PrintedKnownCameraCost{cost, camera_},
                                             board.data());
    }
  }

  void addProjected(const ProjectedCost& cost, PoseBlock& board, const ViewEvidence& view) {
    if (settings_.free_camera) {
      add<ProjectedCost, kLensSize, kPoseSize, kLensSize, kPoseSize>(
          new ProjectedCost(cost), camera_.data(), board.data(), lens_.data(), pose_.data());
    } else if (settings_.free_boards) {
      add<ProjectedKnownCameraCost, kPoseSize, kLensSize, kPoseSize>(
          new ProjectedKnownCameraCost{cost}, board.data(), lens_.data(), pose_.data());
    } else {
      std::array<Eigen::Vector3d, 4> p_camera;
      for (std::size_t i = 0; i < 4; ++i) {
        p_camera[i] = onBoard(cost.tag->rays[i], view.T_camera_board);
      }
      add<ProjectedKnownBoardCost, kLensSize, kPoseSize>(
          new ProjectedKnownBoardCost{cost, p_camera}, lens_.data(), pose_.data());
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
    if (problem_.HasParameterBlock(camera_.data())) {
      holdCamera(problem_, camera_, model_, settings_);
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
  // Skew, number 4 of the block, is not among kCalibrationParameters.
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

CameraMatrix cameraCovariance(const ProjectorModel& model, std::vector<ViewEvidence>& views,
                              const RefineSettings& settings) {
  const Eigen::MatrixXd full = Bundle(model, views, settings).cameraCovariance();
  // Skew, number 4 of the block, is not estimated.
  const auto from = [](Eigen::Index i) { return i < 4 ? i : i + 1; };
  CameraMatrix covariance;
  for (Eigen::Index row = 0; row < kCameraParameters; ++row) {
    for (Eigen::Index column = 0; column < kCameraParameters; ++column) {
      covariance(row, column) = full(from(row), from(column));
    }
  }
  return covariance;
}

void refineBoardPose(const ProjectorModel& model, ViewEvidence& view) {
  PoseBlock board = blockOf(view.T_camera_board.matrix());
  ceres::Problem problem;
  for (const Sighting& tag : view.printed) {
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<PrintedKnownCameraCost, 8, kPoseSize>(
            new PrintedKnownCameraCost{{&tag, whitening(tag.covariance), model.camera.model},
                                       blockOf(model.camera)}),
        new ceres::CauchyLoss(4 * model.printed_scale * std::sqrt(8.0)), board.data());
  }
  if (view.printed.empty()) return;
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  view.T_camera_board = Rigid<Camera, Surface>(isometryOf(board));
}

PrintStretch printStretch(const ProjectorModel& model, const std::vector<ViewEvidence>& views,
                          bool free_camera) {
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
                             whitening(tag.covariance * model.printed_scale * model.printed_scale),
                             model.camera.model};
      problem.AddResidualBlock(
          new ceres::AutoDiffCostFunction<StretchedCost, 8, kLensSize, kPoseSize, 1>(
              new StretchedCost{cost}),
          new ceres::CauchyLoss(4 * std::sqrt(8.0)), camera.data(), boards.back().data(), &stretch);
    }
  }
  if (!problem.HasParameterBlock(&stretch)) return {};
  RefineSettings settings;
  settings.free_camera = free_camera;
  holdCamera(problem, camera, model, settings);
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

PixelShape pixelShape(const ProjectorModel& model, const std::vector<ViewEvidence>& views,
                      bool free_camera) {
  ProjectorModel free = model;
  std::vector<ViewEvidence> moved = views;
  RefineSettings settings;
  settings.free_skew = true;
  settings.free_camera = free_camera;
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

}  // namespace afterglow::calib
