#include "calib/mount/turret_fit.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>

#include "calib/number_text.hpp"

namespace afterglow::calib {
namespace {

/// Standard deviations of what a description says of a joint. Direction: a bracket between two bent
/// or machined faces of 10 to 50 mm, 0.5 degrees each (ISO 2768-1, class m). Place: measured with a
/// ruler. Zero: a horn is set by hand on a spline, and a servo's count is 0.29 degrees (AX-12A).
/// Scale: 300 degrees of a potentiometer, within three counts.
struct JointPrior {
  double axis_deg = 0.7, axis_mm = 5, zero_deg = 2, scale = 0.003;
};
/// The first joint's errors hold those of the camera's place on the robot as well, which nobody
/// measures better either.
constexpr JointPrior kFirstJoint{1.5, 12, 2.5, 0.003}, kJoint;

/// The deviation of a pose: what a calibration says of its own T_camera_projector at worst, and
/// about what faulty rooms do to it (tests/bench/calibration_faults.py), as if it came from so many
/// numbers; the poses' own agreement, in which encoders and tf have their part, weighs as many as
/// they leave.
constexpr double kPose_mm = 0.15, kPose_deg = 0.015, kPriorNumbers = 6;

constexpr std::size_t kFewestPoses = 3;
constexpr double kLeastSpan_deg = 20;
/// A motion that is so far off its one axis is no joint's, or another joint moved too. tf has nine
/// digits and more.
constexpr double kOffAxis_deg = 0.5, kOffAxis_m = 0.0005;

/// A pose is left out if the others' chi-square (of 6 numbers less) falls by so many times what
/// their own agreement makes likely: the F distribution of 6 and 13 exceeds 11 once in 10,000
/// times, and few poses agree too well by chance.
constexpr double kChanceRatio = 20;
constexpr std::size_t kFewestToLeaveOut = 4;

constexpr double kLight_m = 1.5, kBeyond_deg = 45;
/// Student's t for some 15 numbers: 95 of 100 lie within.
constexpr double kCertain = 2.13;
constexpr int kJointParameters = 7;  // rotation and translation of the correction; scale

Eigen::Isometry3d smallPose(const Eigen::Ref<const Eigen::VectorXd>& twist) {
  const Eigen::Vector3d turn = twist.head<3>();
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  const double angle = turn.norm();
  if (angle > 0) T.linear() = Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix();
  T.translation() = twist.segment<3>(3);
  return T;
}

/// The middle of what the joint did, and the axis it turned about; z where it did not turn.
TurretJoint jointOf(const std::vector<TurretPose>& poses, std::size_t index,
                    const std::vector<std::string>& links) {
  TurretJoint joint;
  joint.parent = links[index];
  joint.link = links[index + 1];
  std::vector<Eigen::Quaterniond> turns;
  for (const TurretPose& pose : poses) turns.emplace_back(pose.T_parent_link[index].linear());
  joint.R_parent_middle = meanRotation(turns);
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const Eigen::Quaterniond& turn : turns) {
    const Eigen::Vector3d w = turnOf((joint.R_parent_middle.inverse() * turn).toRotationMatrix());
    sum += w * w.transpose();
  }
  if (sum.trace() < 1e-12) return joint;
  joint.axis = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(sum).eigenvectors().col(2);
  Eigen::Index largest = 0;
  joint.axis.cwiseAbs().maxCoeff(&largest);
  if (joint.axis[largest] < 0) joint.axis = -joint.axis;
  return joint;
}

std::vector<TurretJoint> jointsOf(const std::vector<TurretPose>& poses,
                                  const std::vector<std::string>& links) {
  std::vector<TurretJoint> joints;
  for (std::size_t i = 0; i + 1 < links.size(); ++i) joints.push_back(jointOf(poses, i, links));
  return joints;
}

void requireOneAxis(const std::vector<TurretPose>& poses, const TurretJoint& joint,
                    std::size_t index) {
  const Eigen::Isometry3d& first = poses.front().T_parent_link[index];
  for (const TurretPose& pose : poses) {
    const Eigen::Isometry3d& T = pose.T_parent_link[index];
    const Eigen::Vector3d w =
        turnOf((joint.R_parent_middle.inverse() * Eigen::Quaterniond(T.linear())).matrix());
    const double off_deg = (w - w.dot(joint.axis) * joint.axis).norm() * kDegrees;
    const double off_m = (T.translation() - first.translation()).norm();
    if (off_deg < kOffAxis_deg && off_m < kOffAxis_m) continue;
    throw std::invalid_argument(fmt::format(
        "'{}' does not turn in '{}' about one axis through its origin (at {}: {} mm and {} deg off "
        "it): name the link that the joint itself turns, and the one it turns in",
        joint.link, joint.parent, pose.mount.name, fixedText(1000 * off_m, 1),
        fixedText(off_deg, 1)));
  }
}

void requireTurret(const std::vector<TurretPose>& poses, const std::vector<std::string>& links) {
  if (poses.empty()) throw std::invalid_argument("no pose of a turret");
  if (links.size() < 2) throw std::invalid_argument("a turret has a base and a link that turns");
  for (const TurretPose& pose : poses) {
    bool is_sound = pose.T_parent_link.size() + 1 == links.size() &&
                    pose.mount.T_link_projector.matrix().matrix().allFinite();
    for (const Eigen::Isometry3d& T : pose.T_parent_link) {
      is_sound = is_sound && T.matrix().allFinite();
    }
    if (is_sound) continue;
    throw std::invalid_argument("pose " + pose.mount.name + " is not one of this turret: " +
                                std::to_string(links.size() - 1) + " joints, finite numbers");
  }
  const std::vector<TurretJoint> joints = jointsOf(poses, links);
  for (std::size_t i = 0; i < joints.size(); ++i) requireOneAxis(poses, joints[i], i);
}

/// Least and greatest angle of each joint, rad from its middle.
std::vector<std::array<double, 2>> spansOf(const std::vector<TurretPose>& poses,
                                           const std::vector<TurretJoint>& joints) {
  std::vector<std::array<double, 2>> spans;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    std::array<double, 2> span = {M_PI, -M_PI};
    for (const TurretPose& pose : poses) {
      const double angle = joints[i].angle(pose.T_parent_link[i]);
      span = {std::min(span[0], angle), std::max(span[1], angle)};
    }
    spans.push_back(span);
  }
  return spans;
}

/// The turret as a function of its errors: per joint a correction's turn (about x y z of a frame
/// whose z is the axis) and shift, and the scale; then the projector on the last link, from where
/// the first pose has it.
class TurretModel {
 public:
  TurretModel(const std::vector<TurretPose>& poses, const std::vector<std::string>& links)
      : poses_(poses), joints_(jointsOf(poses, links)) {
    start_ = poses.front().mount.T_link_projector;
    for (std::size_t i = 0; i < joints_.size(); ++i) {
      Eigen::Isometry3d middle = poses.front().T_parent_link[i];
      middle.linear() = joints_[i].R_parent_middle.toRotationMatrix();
      middle.rotate(Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), joints_[i].axis));
      T_parent_axis_.push_back(middle);
    }
  }

  const std::vector<TurretPose>& poses() const { return poses_; }
  int joints() const { return static_cast<int>(joints_.size()); }
  int parameters() const { return kJointParameters * joints() + 6; }
  std::vector<std::array<double, 2>> spans() const { return spansOf(poses_, joints_); }

  Turret at(const Eigen::VectorXd& errors) const {
    Turret turret{joints_, {}, MountFrames().projector};
    for (int i = 0; i < joints(); ++i) {
      const auto of = errors.segment<kJointParameters>(kJointParameters * i);
      const Eigen::Isometry3d& T = T_parent_axis_[static_cast<std::size_t>(i)];
      TurretJoint& joint = turret.joints[static_cast<std::size_t>(i)];
      joint.correction = T * smallPose(of.head<6>()) * T.inverse();
      joint.scale = of[6];
    }
    turret.T_link_projector =
        start_ * Rigid<Projector, Projector>(smallPose(errors.tail<6>()));
    return turret;
  }

  std::vector<Eigen::Isometry3d> tfAt(const std::vector<double>& angles) const {
    std::vector<Eigen::Isometry3d> tf = poses_.front().T_parent_link;
    for (std::size_t i = 0; i < angles.size(); ++i) {
      tf[i].linear() =
          (joints_[i].R_parent_middle * Eigen::AngleAxisd(angles[i], joints_[i].axis)).matrix();
    }
    return tf;
  }

  /// Returns residuals in standard deviations: poses, then priors. The projector's place on the
  /// link has none.
  Eigen::VectorXd residuals(const Eigen::VectorXd& errors) const {
    const Turret turret = at(errors);
    const auto count = static_cast<Eigen::Index>(poses_.size());
    Eigen::VectorXd result(6 * count + kJointParameters * joints());
    for (Eigen::Index i = 0; i < count; ++i) {
      const TurretPose& pose = poses_[static_cast<std::size_t>(i)];
      const Eigen::Isometry3d seen =
          pose.T_base_link() * pose.mount.T_link_projector.matrix();
      const Eigen::Isometry3d off = seen.inverse() * turret.T_base_projector(pose.T_parent_link);
      result.segment<3>(6 * i) = off.translation() * (1000 / kPose_mm);
      result.segment<3>(6 * i + 3) = turnOf(off.linear()) * (kDegrees / kPose_deg);
    }
    for (int i = 0; i < joints(); ++i) {
      const auto of = errors.segment<kJointParameters>(kJointParameters * i);
      result.segment<kJointParameters>(6 * count + kJointParameters * i) =
          of.cwiseQuotient(priorOf(i));
    }
    return result;
  }

  static Eigen::Matrix<double, kJointParameters, 1> priorOf(int joint) {
    const JointPrior prior = joint == 0 ? kFirstJoint : kJoint;
    const double across = prior.axis_deg / kDegrees, place = prior.axis_mm / 1000;
    Eigen::Matrix<double, kJointParameters, 1> deviations;
    deviations << across, across, prior.zero_deg / kDegrees, place, place, place, prior.scale;
    return deviations;
  }

 private:
  std::vector<TurretPose> poses_;
  std::vector<TurretJoint> joints_;
  std::vector<Eigen::Isometry3d> T_parent_axis_;
  Rigid<Link, Projector> start_;
};

using Vectorial = std::function<Eigen::VectorXd(const Eigen::VectorXd&)>;

Eigen::MatrixXd jacobian(const Vectorial& function, const Eigen::VectorXd& at) {
  constexpr double kStep = 1e-6;
  Eigen::MatrixXd J;
  for (Eigen::Index i = 0; i < at.size(); ++i) {
    const Eigen::VectorXd step = Eigen::VectorXd::Unit(at.size(), i) * kStep;
    const Eigen::VectorXd slope = (function(at + step) - function(at - step)) / (2 * kStep);
    if (i == 0) J.resize(slope.size(), at.size());
    J.col(i) = slope;
  }
  return J;
}

struct TurretSolution {
  Eigen::VectorXd errors;
  Eigen::MatrixXd covariance;
  double chi2 = 0;       ///< poses and priors
  double agreement = 1;  ///< size of the poses' deviations beside kPose_mm and kPose_deg
};

/// Gauss and Newton: the errors are small, so that a few steps do. Poses count as having
/// `deviation` times their standard deviations.
TurretSolution solveTurret(const TurretModel& model, double deviation = 1) {
  const auto numbers = 6 * static_cast<Eigen::Index>(model.poses().size());
  const Vectorial residuals = [&](const Eigen::VectorXd& errors) {
    Eigen::VectorXd all = model.residuals(errors);
    all.head(numbers) /= deviation;
    return all;
  };
  TurretSolution solution;
  solution.errors = Eigen::VectorXd::Zero(model.parameters());
  Eigen::MatrixXd J;
  for (int step = 0; step < 10; ++step) {
    J = jacobian(residuals, solution.errors);
    const Eigen::VectorXd change =
        (J.transpose() * J).ldlt().solve(-J.transpose() * residuals(solution.errors));
    solution.errors += change;
    if (change.norm() < 1e-9) break;
  }
  solution.covariance = (J.transpose() * J).inverse();
  const Eigen::VectorXd left = residuals(solution.errors);
  solution.chi2 = left.squaredNorm();
  const Eigen::MatrixXd J_poses = J.topRows(numbers);
  const double told = (J_poses * solution.covariance * J_poses.transpose()).trace();
  const double sum = left.head(numbers).squaredNorm() * deviation * deviation;
  solution.agreement = std::sqrt((sum + kPriorNumbers) /
                                 (static_cast<double>(numbers) - told + kPriorNumbers));
  return solution;
}

/// Solves with deviations as the poses have them (Foerstner, "Ein Verfahren zur Schaetzung von
/// Varianz- und Kovarianzkomponenten", 1979: what is left, by how many numbers are left).
TurretSolution solveByAgreement(const TurretModel& model) {
  TurretSolution solution = solveTurret(model);
  for (int i = 0; i < 4; ++i) solution = solveTurret(model, solution.agreement);
  return solution;
}

/// The pose that the others contradict.
std::optional<std::size_t> findOdd(const std::vector<TurretPose>& poses,
                                   const std::vector<std::string>& links) {
  if (poses.size() < kFewestToLeaveOut) return std::nullopt;
  const double chi2 = solveTurret(TurretModel(poses, links)).chi2;
  std::optional<std::size_t> odd;
  double most = kChanceRatio;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    std::vector<TurretPose> rest = poses;
    rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(i));
    const TurretSolution without = solveTurret(TurretModel(rest, links));
    const double ratio = (chi2 - without.chi2) / 6 / std::pow(std::max(1.0, without.agreement), 2);
    if (ratio <= most) continue;
    most = ratio;
    odd = i;
  }
  return odd;
}

JointError jointError(const TurretSolution& solution, int joint) {
  const int at = kJointParameters * joint;
  const auto variance = [&](int i) { return std::max(0.0, solution.covariance(at + i, at + i)); };
  const auto e = solution.errors.segment<kJointParameters>(at);
  JointError error;
  error.axis_deg = {kDegrees * std::hypot(e[0], e[1]),
                    kDegrees * std::sqrt(variance(0) + variance(1))};
  error.axis_mm = {1000 * std::hypot(e[3], e[4]), 1000 * std::sqrt(variance(3) + variance(4))};
  error.zero_deg = {kDegrees * e[2], kDegrees * std::sqrt(variance(2))};
  error.scale_percent = {100 * e[6], 100 * std::sqrt(variance(6))};
  return error;
}

/// Returns where light in the middle and the corners of a usual picture goes at these angles:
/// places on a wall, in the projector's own frame as the first turret has it, so that two turrets
/// compare.
Eigen::VectorXd lightOf(const Turret& turret, const Turret& as_seen_by,
                        const std::vector<Eigen::Isometry3d>& tf) {
  const Eigen::Isometry3d T =
      as_seen_by.T_base_projector(tf).inverse() * turret.T_base_projector(tf);
  Eigen::VectorXd places(10);
  int row = 0;
  for (const auto& [x, y] : {std::pair(0.0, 0.0), {-0.35, -0.22}, {0.35, -0.22}, {-0.35, 0.22},
                             {0.35, 0.22}}) {
    const Eigen::Vector3d ray = T.linear() * Eigen::Vector3d(x, y, 1), from = T.translation();
    places.segment<2>(row) = (from + (kLight_m - from.z()) / ray.z() * ray).head<2>();
    row += 2;
  }
  return places;
}

double lightOff_mm(const TurretModel& model, const TurretSolution& solution,
                   const std::vector<double>& angles) {
  const Turret best = model.at(solution.errors);
  const std::vector<Eigen::Isometry3d> tf = model.tfAt(angles);
  const Eigen::MatrixXd J = jacobian(
      [&](const Eigen::VectorXd& errors) { return lightOf(model.at(errors), best, tf); },
      solution.errors);
  const Eigen::MatrixXd covariance = J * solution.covariance * J.transpose();
  double worst = 0;
  for (int row = 0; row < 10; row += 2) {
    worst = std::max(worst, covariance.block<2, 2>(row, row).trace());
  }
  return 1000 * kCertain * std::sqrt(worst);
}

/// The worst over least, middle and greatest angle of each joint, so much beyond the poses' own.
double worstLight_mm(const TurretModel& model, const TurretSolution& solution, double beyond_deg) {
  std::vector<std::vector<double>> all = {{}};
  for (const auto& [least, greatest] : model.spans()) {
    std::vector<std::vector<double>> more;
    for (const std::vector<double>& angles : all) {
      for (const double angle : {least - beyond_deg / kDegrees, (least + greatest) / 2,
                                 greatest + beyond_deg / kDegrees}) {
        more.push_back(angles);
        more.back().push_back(angle);
      }
    }
    all = std::move(more);
  }
  double worst = 0;
  for (const auto& angles : all) worst = std::max(worst, lightOff_mm(model, solution, angles));
  return worst;
}

MountDeviation deviationOf(const Turret& turret, const TurretPose& pose) {
  const Eigen::Isometry3d seen = pose.T_base_link() * pose.mount.T_link_projector.matrix();
  const Eigen::Isometry3d off = seen.inverse() * turret.T_base_projector(pose.T_parent_link);
  return {pose.mount.name, 1000 * off.translation().norm(), kDegrees * turnOf(off.linear()).norm(),
          true};
}

/// Deviations of all poses, and the spread of those used. Throws MountRefused beyond the limits.
void setDeviations(TurretFit& fit, const std::vector<TurretPose>& poses,
                   std::optional<std::size_t> odd, const MountLimits& limits) {
  std::vector<std::string> far;
  double mm = 0, deg = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    fit.poses.push_back(deviationOf(fit.turret, poses[i]));
    MountDeviation& off = fit.poses.back();
    off.is_used = i != odd;
    if (!off.is_used) continue;
    mm += off.mm * off.mm;
    deg += off.deg * off.deg;
    if (off.mm <= limits.mm && off.deg <= limits.deg) continue;
    far.push_back(off.name + " " + fixedText(off.mm, 1) + " mm " + fixedText(off.deg, 2) + " deg");
  }
  if (!far.empty()) {
    throw MountRefused(fmt::format(
        "no turret turns like that; from the nearest that does, where {} mm and {} deg are "
        "allowed: {}; check that each pose's transforms are of the moment of its calibration",
        fixedText(limits.mm, 1), fixedText(limits.deg, 2), fmt::join(far, ", ")));
  }
  const double used = static_cast<double>(poses.size() - (odd ? 1 : 0));
  fit.spread_mm = std::sqrt(mm / used);
  fit.spread_deg = std::sqrt(deg / used);
}

std::string valueText(const JointError::Value& value, int decimals) {
  return fixedText(value.value, decimals) + " (deviation " + fixedText(value.deviation, decimals) +
         ")";
}

}  // namespace

Eigen::Isometry3d TurretPose::T_base_link() const {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  for (const Eigen::Isometry3d& joint : T_parent_link) T = T * joint;
  return T;
}

std::vector<std::string> missingTurns(const std::vector<TurretPose>& poses,
                                      const std::vector<std::string>& links) {
  requireTurret(poses, links);
  std::vector<std::string> missing;
  if (poses.size() < kFewestPoses) {
    missing.push_back(fmt::format("{} of {} poses that are needed (five are good)", poses.size(),
                                  kFewestPoses));
  }
  const auto spans = spansOf(poses, jointsOf(poses, links));
  for (std::size_t i = 0; i < spans.size(); ++i) {
    const double span_deg = kDegrees * (spans[i][1] - spans[i][0]);
    if (span_deg >= kLeastSpan_deg) continue;
    missing.push_back(fmt::format("turn '{}', too: it turned by {} deg, {} are needed",
                                  links[i + 1], fixedText(span_deg, 1),
                                  fixedText(kLeastSpan_deg, 0)));
  }
  return missing;
}

TurretFit fitTurret(const std::vector<TurretPose>& poses, const std::vector<std::string>& links,
                    const MountLimits& limits) {
  if (const auto missing = missingTurns(poses, links); !missing.empty()) {
    throw MountRefused(fmt::format("{}", fmt::join(missing, "; ")));
  }
  const std::optional<std::size_t> odd = findOdd(poses, links);
  std::vector<TurretPose> used = poses;
  if (odd) {
    used.erase(used.begin() + static_cast<std::ptrdiff_t>(*odd));
    if (const auto missing = missingTurns(used, links); !missing.empty()) {
      throw MountRefused(fmt::format("without {}, which the other poses contradict: {}",
                                     poses[*odd].mount.name, fmt::join(missing, "; ")));
    }
  }
  const TurretModel model(used, links);
  const TurretSolution solution = solveByAgreement(model);
  TurretFit fit;
  fit.turret = model.at(solution.errors);
  setDeviations(fit, poses, odd, limits);
  const auto spans = model.spans();
  for (int i = 0; i < model.joints(); ++i) {
    fit.errors.push_back(jointError(solution, i));
    const auto& [least, greatest] = spans[static_cast<std::size_t>(i)];
    fit.errors.back().span_deg = kDegrees * (greatest - least);
  }
  fit.light_mm = worstLight_mm(model, solution, 0);
  fit.light_beyond_mm = worstLight_mm(model, solution, kBeyond_deg);
  return fit;
}

std::vector<std::string> turretRemarks(const TurretFit& fit) {
  std::vector<std::string> remarks = {fmt::format(
      "Light at 1.5 m is off by at most {} mm in 95 of 100 cases at angles between those of the",
      fixedText(fit.light_mm, 2))};
  remarks.push_back(
      fmt::format("poses, by {} mm up to 45 degrees beyond.", fixedText(fit.light_beyond_mm, 2)));
  for (const MountDeviation& pose : fit.poses) {
    remarks.push_back(fmt::format("Pose {}: {} mm, {} deg off{}.", pose.name,
                                  fixedText(pose.mm, 2), fixedText(pose.deg, 3),
                                  pose.is_used ? "" : ", left out"));
  }
  for (std::size_t i = 0; i < fit.errors.size(); ++i) {
    const JointError& error = fit.errors[i];
    remarks.push_back(fmt::format(
        "The axis of {} is off by {} deg and {} mm, its zero by {} deg, its scale by {} %.",
        fit.turret.joints[i].link, valueText(error.axis_deg, 2), valueText(error.axis_mm, 1),
        valueText(error.zero_deg, 2), valueText(error.scale_percent, 2)));
  }
  return remarks;
}

}  // namespace afterglow::calib
