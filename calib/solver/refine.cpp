#include "calib/solver/refine.hpp"

#include <ceres/ceres.h>
#include <ceres/normal_prior.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/median.hpp"
#include "calib/solver/costs.hpp"

namespace afterglow::calib {
namespace {

/// d projector pixel / d camera pixel at a corner, through the board's plane.
Eigen::Matrix2d pixelTransfer(const ProjectorModel& model, const ViewEvidence& view,
                              const Eigen::Vector2d& ray) {
  const Rigid<Projector, Camera> T_projector_camera = model.T_camera_projector.inverse();
  const auto pixel = [&](const Eigen::Vector2d& at) -> Eigen::Vector2d {
    const Eigen::Vector3d p = T_projector_camera * onBoard(at, view.T_camera_board, model.shape);
    return (model.projector.K * distort(model.projector, p.hnormalized()).homogeneous()).head<2>();
  };
  // A tenth of a camera pixel. The camera's own distortion changes its scale by a few percent
  // only.
  const double step = 0.1 / model.camera.K(0, 0);
  Eigen::Matrix2d J;
  for (int k = 0; k < 2; ++k) {
    const Eigen::Vector2d by = step * Eigen::Vector2d::Unit(k);
    J.col(k) = (pixel(ray + by) - pixel(ray - by)) / (2 * 0.1);
  }
  return J;
}

double deviationsOf(const Vector8& error, const Matrix8& covariance, double scale) {
  return (whitening(covariance) * error).norm() / (std::sqrt(8.0) * scale);
}

constexpr double kOutlierDeviations = 6;

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

Matrix8 whitening(const Matrix8& covariance) {
  const Matrix8 L = covariance.llt().matrixL();
  return L.triangularView<Eigen::Lower>().solve(Matrix8::Identity());
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

bool isOutlier(const TagError& error) { return !(error.deviations < kOutlierDeviations); }

TagError printedError(const ProjectorModel& model, const ViewEvidence& view, const Sighting& tag) {
  TagError result;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto pixel =
        project(model.camera, view.T_camera_board * model.shape.place(tag.target[i]));
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
        project(model.projector,
                T_projector_camera * onBoard(tag.rays[i], view.T_camera_board, model.shape));
    result.error.segment<2>(2 * Eigen::Index(i)) =
        pixel ? Eigen::Vector2d(*pixel - tag.target[i])
              : Eigen::Vector2d(Eigen::Vector2d::Constant(std::nan("")));
  }
  result.deviations =
      deviationsOf(result.error, projectorCovariance(model, view, tag), model.projected_scale);
  return result;
}

void measureScales(ProjectorModel& model, const std::vector<ViewEvidence>& views) {
  model.printed_scale = model.projected_scale = 1;
  Deviations all = deviationsOf(model, views);
  // The middle of a chi with eight degrees of freedom, per degree, is 0.958.
  constexpr double kMiddle = 0.958;
  constexpr double kLeast = 1e-3;
  if (!all.printed.empty()) {
    model.printed_scale = std::max(median(all.printed, 0) / kMiddle, kLeast);
  }
  if (!all.projected.empty()) {
    model.projected_scale = std::max(median(all.projected, 0) / kMiddle, kLeast);
  }
}

void widenScales(ProjectorModel& model, const std::vector<ViewEvidence>& views) {
  const Deviations all = deviationsOf(model, views);
  model.printed_scale *= rootMeanSquare(all.printed);
  model.projected_scale *= rootMeanSquare(all.projected);
}

namespace {

/// Keeps some of a block's parameters as they are. Ceres renamed this in 2.1 (Debian 11 has 1.14).
void hold(ceres::Problem& problem, double* block, int size, const std::vector<int>& held) {
#if CERES_VERSION_MAJOR < 2 || (CERES_VERSION_MAJOR == 2 && CERES_VERSION_MINOR < 1)
  problem.SetParameterization(block, new ceres::SubsetParameterization(size, held));
#else
  problem.SetManifold(block, new ceres::SubsetManifold(size, held));
#endif
}

LensBlock blockOf(const Lens& lens) {
  LensBlock block{lens.K(0, 0), lens.K(1, 1), lens.K(0, 2), lens.K(1, 2), lens.K(0, 1)};
  std::copy(lens.D.begin(), lens.D.end(), block.begin() + 5);
  return block;
}

Lens lensOf(const LensBlock& block, const Lens& like) {
  Lens lens = lensOf(block.data(), like.model);
  lens.width = like.width;
  lens.height = like.height;
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

/// The rotation vector turns it further; the translation takes the place of its own.
Rigid<Camera, Projector> turnedBy(const Rigid<Camera, Projector>& T, const PoseBlock& pose) {
  Eigen::Isometry3d turned = T.matrix();
  turned.linear() = turned.linear() * isometryOf(pose).linear();
  turned.translation() = Eigen::Map<const Eigen::Vector3d>(pose.data() + 3);
  return Rigid<Camera, Projector>(turned);
}

std::vector<int> heldOfCamera(const RefineSettings& settings) {
  if (settings.free_camera && settings.free_camera_distortion) return {4, 9, 10, 11, 12};
  if (settings.free_camera) return {4, 5, 6, 7, 8, 9, 10, 11, 12};
  return {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};
}

std::vector<int> heldOfLens(const RefineSettings& settings) {
  std::vector<int> held;
  if (!settings.free_skew) held.push_back(4);
  if (!settings.free_rational) held.insert(held.end(), {10, 11, 12});
  return held;
}

/// Prior knowledge of a block of parameters: `root` (x - usual) is white noise.
struct Prior {
  ceres::Matrix root;
  ceres::Vector usual;
};

/// A projector that was calibrated before, with its covariance and the usual drift since.
Prior lensDriftPrior(const ProjectorEstimate& start) {
  using Vector = Eigen::Matrix<double, kLensSize, 1>;
  using Matrix = Eigen::Matrix<double, kLensSize, kLensSize>;
  const LensBlock before = blockOf(start.projector);
  const double fx = before[0], fy = before[1];
  const double center_px = LensDrift::kCenter * start.projector.width;
  Matrix covariance = Matrix::Identity();  // of the skew, held
  for (Eigen::Index i = 0; i < kLensSize - 1; ++i) {
    for (Eigen::Index k = 0; k < kLensSize - 1; ++k) {
      covariance(sharedIndex(i), sharedIndex(k)) = start.covariance(i, k);
    }
  }
  Vector alike = Vector::Zero(), alone = alike;
  alike.head<2>() << LensDrift::kFocal * fx, LensDrift::kFocal * fy;
  alone << LensDrift::kAspect * fx, LensDrift::kAspect * fy, center_px, center_px, 0, 5e-3, 1e-2,
      5e-4, 5e-4, 1e-2, 1e-2, 1e-2, 1e-2;
  covariance += alike * alike.transpose();
  covariance.diagonal() += alone.cwiseAbs2();
  const Matrix L = covariance.llt().matrixL();
  return {L.triangularView<Eigen::Lower>().solve(Matrix::Identity()),
          Eigen::Map<const Vector>(before.data())};
}

/// Projectors as they are: without it high distortion terms explode where no board was held.
Prior lensPrior(const LensBlock& start, double aspect_deviation) {
  constexpr double kDeviations[8] = {0.5, 0.3, 0.003, 0.003, 0.05, 0.3, 0.1, 0.03};
  Prior prior{ceres::Matrix::Zero(9, kLensSize), ceres::Vector::Zero(kLensSize)};
  prior.root(0, 0) = 1 / (start[1] * aspect_deviation);
  prior.root(0, 1) = -prior.root(0, 0);
  for (int i = 0; i < 8; ++i) prior.root(1 + i, 5 + i) = 1 / kDeviations[i];
  return prior;
}

/// A camera's camera_info, with the usual deviations. The aspect ratio is known far better than
/// the focal length, so the two are separate.
Prior cameraPrior(const LensBlock& given, const CameraDeviations& deviations) {
  Prior prior{ceres::Matrix::Zero(kCameraParameters, kLensSize),
              Eigen::Map<const Eigen::Matrix<double, kLensSize, 1>>(given.data())};
  for (int i = 0; i < 2; ++i) {
    const double one = 1 / given[std::size_t(i)];
    prior.root(0, i) = 0.5 * one / deviations.focal;
    prior.root(1, i) = (i == 0 ? one : -one) / deviations.aspect;
    prior.root(2 + i, 2 + i) = 1 / deviations.center_px;
  }
  for (int i = 0; i < 4; ++i) prior.root(4 + i, 5 + i) = 1 / deviations.D[std::size_t(i)];
  return prior;
}

/// Boards as they are; their stretch may be left to the views.
Prior shapePrior(bool free_stretch) {
  constexpr double kWide = 0.02;
  ShapeVector deviations = usualShape();
  if (free_stretch) deviations[0] = kWide;
  return {deviations.cwiseInverse().asDiagonal().toDenseMatrix(), ceres::Vector::Zero(kShapeSize)};
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
    Eigen::Map<ShapeVector>(shape_.data()) = model.shape.parameters;
    Eigen::Map<Eigen::Vector3d>(pose_.data()).setZero();
    Eigen::Map<Eigen::Vector3d>(pose_.data() + 3) = model.T_camera_projector.matrix().translation();
    boards_.resize(views.size());
    for (std::size_t i = 0; i < views.size(); ++i) {
      if (views[i].is_used) addView(i);
    }
    addPriors();
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
    model.shape.parameters = Eigen::Map<const ShapeVector>(shape_.data());
    if (settings_.free_camera) {
      model.camera = lensOf(camera_, model.camera);
      for (ViewEvidence& view : views_) setRays(view, model.camera);
    }
    model.T_camera_projector = turnedBy(model.T_camera_projector, pose_);
    for (std::size_t i = 0; i < views_.size(); ++i) {
      if (views_[i].is_used) {
        views_[i].T_camera_board = Rigid<Camera, Surface>(isometryOf(boards_[i]));
      }
    }
  }

  Influence influence() const {
    Influence influence;
    influence.views.resize(views_.size());
    std::vector<WithBoard> sums(views_.size());
    for (const Block& block : blocks_) addTo(block, sums[block.view]);
    for (std::size_t i = 0; i < sums.size(); ++i) influence.views[i] = sums[i].eliminated();
    for (const Block& block : priors_) {
      WithBoard sum;
      addTo(block, sum);
      influence.prior += sum.information.topLeftCorner<kSharedSize, kSharedSize>();
    }
    influence.is_free.fill(true);
    const auto hold = [&](Eigen::Index from, const std::vector<int>& held) {
      for (int i : held) influence.is_free[std::size_t(from + i)] = false;
    };
    hold(kLensAt, heldOfLens(settings_));
    hold(kCameraAt, heldOfCamera(settings_));
    for (int i = 0; i < kShapeSize; ++i) {
      if (!settings_.free_shape) hold(kShapeAt, {i});
    }
    return influence;
  }

 private:
  /// A cost function, as Ceres knows it, and where its parameters stand among the shared ones;
  /// kBoardAt stands for the view's board.
  struct Block {
    const ceres::CostFunction* cost;
    std::vector<double*> parameters;
    std::vector<Eigen::Index> at;
    std::size_t view = 0;
    bool is_robust = true;
  };
  static constexpr Eigen::Index kBoardAt = kSharedSize, kAllSize = kSharedSize + kPoseSize;

  struct WithBoard {
    Eigen::Matrix<double, kAllSize, kAllSize> information =
        Eigen::Matrix<double, kAllSize, kAllSize>::Zero();
    Eigen::Matrix<double, kAllSize, 1> score = Eigen::Matrix<double, kAllSize, 1>::Zero();

    Influence::OfView eliminated() const {
      const Eigen::MatrixXd board = information.bottomRightCorner<kPoseSize, kPoseSize>();
      if (!(board.diagonal().array() > 0).all()) return {};
      const Eigen::MatrixXd mixed = information.bottomLeftCorner<kPoseSize, kSharedSize>();
      const Eigen::MatrixXd solved = Eigen::LDLT<Eigen::MatrixXd>(board).solve(mixed);
      Influence::OfView view;
      view.information = information.topLeftCorner<kSharedSize, kSharedSize>() -
                         mixed.transpose().lazyProduct(solved);
      view.score =
          score.head<kSharedSize>() - solved.transpose().lazyProduct(score.tail<kPoseSize>());
      return view;
    }
  };

  void addTo(const Block& block, WithBoard& sum) const {
    using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const int rows = block.cost->num_residuals();
    Eigen::VectorXd residual(rows);
    std::vector<Rows> slopes;
    std::vector<double*> to;
    for (int size : block.cost->parameter_block_sizes()) slopes.emplace_back(rows, size);
    for (Rows& slope : slopes) to.push_back(slope.data());
    if (!block.cost->Evaluate(block.parameters.data(), residual.data(), to.data())) return;
    double rho[3] = {0, 1, 0};
    if (block.is_robust) {
      ceres::CauchyLoss(lossScale()).Evaluate(residual.squaredNorm(), rho);
    }
    for (std::size_t i = 0; i < slopes.size(); ++i) {
      sum.score.segment(block.at[i], slopes[i].cols()) +=
          rho[1] * slopes[i].transpose() * residual;
      for (std::size_t k = 0; k < slopes.size(); ++k) {
        sum.information.block(block.at[i], block.at[k], slopes[i].cols(), slopes[k].cols()) +=
            rho[1] * slopes[i].transpose().lazyProduct(slopes[k]);
      }
    }
  }

  void addView(std::size_t index) {
    ViewEvidence& view = views_[index];
    PoseBlock& board = boards_[index];
    board = blockOf(view.T_camera_board.matrix());
    const Eigen::Vector2d& half_m = model_.shape.half_m;
    const double printed_2 = model_.printed_scale * model_.printed_scale;
    const double projected_2 = model_.projected_scale * model_.projected_scale;
    const bool can_printed_move =
        settings_.free_boards || settings_.free_camera || settings_.free_shape;
    for (const Sighting& tag : view.printed) {
      if (!can_printed_move) break;
      add(index, new PrintedCost(tag, whitening(tag.covariance * printed_2), model_.camera.model,
                                 half_m),
          {camera_.data(), board.data(), shape_.data()}, {kCameraAt, kBoardAt, kShapeAt});
    }
    for (const Sighting& tag : view.projected) {
      if (!settings_.use_projected) break;
      const Matrix8 covariance = projectorCovariance(model_, view, tag) * projected_2;
      if (!covariance.allFinite()) continue;
      add(index,
          new ProjectedCost(tag, whitening(covariance), model_.T_camera_projector.matrix().linear(),
                            model_.camera.model, settings_.free_camera, half_m),
          {camera_.data(), board.data(), shape_.data(), lens_.data(), pose_.data()},
          {kCameraAt, kBoardAt, kShapeAt, kLensAt, kPoseAt});
    }
    if (!settings_.free_boards && problem_.HasParameterBlock(board.data())) {
      problem_.SetParameterBlockConstant(board.data());
    }
  }

  void add(std::size_t view, ceres::CostFunction* cost, const std::vector<double*>& parameters,
           const std::vector<Eigen::Index>& at) {
    problem_.AddResidualBlock(cost, new ceres::CauchyLoss(lossScale()), parameters);
    blocks_.push_back({cost, parameters, at, view});
  }
  /// The loss's scale for the norm of the eight whitened errors of a tag.
  double lossScale() const { return settings_.robust_deviations * std::sqrt(8.0); }

  void addPrior(const Prior& prior, double* block, Eigen::Index at, const std::vector<int>& held) {
    if (!problem_.HasParameterBlock(block)) return;
    const int size = int(prior.usual.size());
    if (held.size() == std::size_t(size)) return problem_.SetParameterBlockConstant(block);
    auto* cost = new ceres::NormalPrior(prior.root, prior.usual);
    problem_.AddResidualBlock(cost, nullptr, block);
    priors_.push_back({cost, {block}, {at}, 0, false});
    if (!held.empty()) hold(problem_, block, size, held);
  }

  void addPriors() {
    const bool was_calibrated = model_.start && !settings_.free_skew;
    addPrior(was_calibrated ? lensDriftPrior(*model_.start)
                            : lensPrior(lens_, settings_.free_skew ? 1.0 : 0.01),
             lens_.data(), kLensAt, heldOfLens(settings_));
    addPrior(cameraPrior(blockOf(model_.camera_info), usualDeviations(model_.camera_info)),
             camera_.data(), kCameraAt, heldOfCamera(settings_));
    std::vector<int> held;
    for (int i = 0; i < kShapeSize; ++i) {
      if (!settings_.free_shape) held.push_back(i);
    }
    addPrior(shapePrior(settings_.free_stretch), shape_.data(), kShapeAt, held);
  }

  const ProjectorModel& model_;
  std::vector<ViewEvidence>& views_;
  RefineSettings settings_;
  ceres::Problem problem_;
  LensBlock lens_, camera_;
  PoseBlock pose_;
  ShapeBlock shape_;
  std::vector<PoseBlock> boards_;
  std::vector<Block> blocks_, priors_;
};

SharedMatrix covarianceOf(const Influence& influence) {
  const auto covariance = influence.covariance();
  if (!covariance) {
    throw CalibrationRefused(
        {"the views leave the projector undetermined: tilt the board more, and differently"});
  }
  return *covariance;
}

}  // namespace

ProjectorModel movedBy(const ProjectorModel& model, const SharedVector& by) {
  ProjectorModel moved = model;
  const auto add = [&](Lens& lens, Eigen::Index at) {
    LensBlock block = blockOf(lens);
    for (std::size_t i = 0; i < block.size(); ++i) block[i] += by[at + Eigen::Index(i)];
    lens = lensOf(block, lens);
  };
  add(moved.projector, kLensAt);
  if (!by.segment<kLensSize>(kCameraAt).isZero(0)) add(moved.camera, kCameraAt);
  PoseBlock pose;
  Eigen::Map<Eigen::Matrix<double, kPoseSize, 1>> block(pose.data());
  block = by.segment<kPoseSize>(kPoseAt);
  block.tail<3>() += model.T_camera_projector.matrix().translation();
  moved.T_camera_projector = turnedBy(model.T_camera_projector, pose);
  moved.shape.parameters += by.segment<kShapeSize>(kShapeAt);
  return moved;
}

void refine(ProjectorModel& model, std::vector<ViewEvidence>& views,
            const RefineSettings& settings) {
  Bundle bundle(model, views, settings);
  bundle.solve();
  bundle.store(model);
}

Influence influenceOf(const ProjectorModel& model, std::vector<ViewEvidence>& views,
                      const RefineSettings& settings) {
  return Bundle(model, views, settings).influence();
}

ProjectorEstimate estimateOf(const ProjectorModel& model, const Influence& influence,
                             double dispersion) {
  ProjectorEstimate estimate;
  estimate.projector = model.projector;
  estimate.T_camera_projector = model.T_camera_projector;
  covarianceOf(influence);  // or refuses
  const SharedMatrix full = *influence.covariance(dispersion);
  for (Eigen::Index row = 0; row < kCalibrationParameters; ++row) {
    for (Eigen::Index column = 0; column < kCalibrationParameters; ++column) {
      estimate.covariance(row, column) = full(sharedIndex(row), sharedIndex(column));
    }
  }
  return estimate;
}

CameraMatrix cameraCovariance(const Influence& influence) {
  const SharedMatrix full = covarianceOf(influence);
  // Skew, number 4 of the block, is not estimated.
  const auto from = [](Eigen::Index i) { return kCameraAt + (i < 4 ? i : i + 1); };
  CameraMatrix covariance;
  for (Eigen::Index row = 0; row < kCameraParameters; ++row) {
    for (Eigen::Index column = 0; column < kCameraParameters; ++column) {
      covariance(row, column) = full(from(row), from(column));
    }
  }
  return covariance;
}

void refineBoardPose(const ProjectorModel& model, ViewEvidence& view) {
  if (view.printed.empty()) return;
  PoseBlock board = blockOf(view.T_camera_board.matrix());
  LensBlock camera = blockOf(model.camera);
  ShapeBlock shape;
  Eigen::Map<ShapeVector>(shape.data()) = model.shape.parameters;
  ceres::Problem problem;
  for (const Sighting& tag : view.printed) {
    problem.AddResidualBlock(new PrintedCost(tag, whitening(tag.covariance), model.camera.model,
                                             model.shape.half_m),
                             new ceres::CauchyLoss(4 * model.printed_scale * std::sqrt(8.0)),
                             camera.data(), board.data(), shape.data());
  }
  problem.SetParameterBlockConstant(camera.data());
  problem.SetParameterBlockConstant(shape.data());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  view.T_camera_board = Rigid<Camera, Surface>(isometryOf(board));
}

PrintStretch printStretch(const ProjectorModel& model, const std::vector<ViewEvidence>& views,
                          bool free_camera) {
  ProjectorModel free = model;
  std::vector<ViewEvidence> moved = views;
  RefineSettings settings;
  settings.free_camera = free_camera;
  settings.free_shape = settings.free_stretch = true;
  settings.use_projected = false;
  refine(free, moved, settings);
  Influence influence = influenceOf(free, moved, settings);
  for (Eigen::Index i = kLensAt; i < kCameraAt; ++i) influence.is_free[std::size_t(i)] = false;
  const auto covariance = influence.covariance();
  return {free.shape.parameters[0], covariance ? std::sqrt((*covariance)(kShapeAt, kShapeAt)) : 0};
}

PixelShape pixelShape(const ProjectorModel& model, const std::vector<ViewEvidence>& views,
                      bool free_camera) {
  ProjectorModel free = model;
  std::vector<ViewEvidence> moved = views;
  RefineSettings settings;
  settings.free_skew = true;
  settings.free_camera = free_camera;
  settings.free_shape = true;
  refine(free, moved, settings);
  const SharedMatrix covariance = covarianceOf(influenceOf(free, moved, settings));
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
