// RobotModel's inverse kinematics: KDL's Levenberg-Marquardt from a few starts, and aiming.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <kdl/chain.hpp>
#include <kdl/chainiksolverpos_lma.hpp>
#include <random>

#include "nodes/fetch/robot_model.hpp"
#include "replay/motion/planar_pose.hpp"

namespace afterglow::nodes {
namespace {

constexpr int kStarts = 60;
constexpr int kEnough = 5;  ///< solutions to choose the nearest from
using replay::kPi, replay::wrapAngle;

KDL::Vector toKdl(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

KDL::Frame toKdl(const Eigen::Isometry3d& T) {
  const Eigen::Quaterniond q(T.linear());
  return {KDL::Rotation::Quaternion(q.x(), q.y(), q.z(), q.w()), toKdl(T.translation())};
}

/// The chain as KDL sees it: held and fixed joints become part of the links.
struct KdlChain {
  KDL::Chain chain;
  std::vector<const Joint*> joints;  ///< the free ones
};

KdlChain makeKdlChain(const std::vector<const Joint*>& path, const JointPositions& seed,
                      const std::set<std::string>& held) {
  KdlChain result;
  for (const Joint* joint : path) {
    if (!joint->moves() || held.count(joint->name)) {
      const double position = joint->moves() ? seed.at(joint->name) : 0.0;
      result.chain.addSegment(KDL::Segment(KDL::Joint(), toKdl(joint->T_parent_child(position))));
      continue;
    }
    const Eigen::Vector3d axis = joint->T_parent_joint.linear() * joint->axis;
    const auto type =
        joint->kind == Joint::Kind::Prismatic ? KDL::Joint::TransAxis : KDL::Joint::RotAxis;
    result.chain.addSegment(KDL::Segment(
        KDL::Joint(joint->name, toKdl(joint->T_parent_joint.translation()), toKdl(axis), type),
        toKdl(joint->T_parent_joint)));
    result.joints.push_back(joint);
  }
  return result;
}

/// A start for the search: the seed, then ever further from it. Plain arithmetic on mt19937's
/// output, since the standard's distributions differ between libraries.
KDL::JntArray makeStart(const KdlChain& chain, const KDL::JntArray& seed, int attempt,
                        std::mt19937& random) {
  KDL::JntArray start = seed;
  const double spread = std::min(1.0, 0.05 * attempt);
  for (std::size_t i = 0; i < chain.joints.size(); ++i) {
    const Joint& joint = *chain.joints[i];
    const bool endless = joint.kind == Joint::Kind::Continuous;
    const double half = endless ? kPi : (joint.upper - joint.lower) / 2;
    const double unit = static_cast<double>(random()) / 4294967295.0 * 2 - 1;
    const auto k = static_cast<unsigned>(i);
    start(k) = std::clamp(seed(k) + spread * half * unit, joint.lower, joint.upper);
  }
  return start;
}

/// Turns revolute joints by whole turns toward the seed and checks the limits.
bool settle(const KdlChain& chain, const KDL::JntArray& seed, KDL::JntArray& q) {
  for (std::size_t i = 0; i < chain.joints.size(); ++i) {
    const Joint& joint = *chain.joints[i];
    const auto k = static_cast<unsigned>(i);
    if (joint.kind == Joint::Kind::Continuous)
      q(k) = seed(k) + wrapAngle(q(k) - seed(k));
    if (joint.kind == Joint::Kind::Revolute) q(k) = wrapAngle(q(k));
    if (q(k) < joint.lower || q(k) > joint.upper) return false;
  }
  return true;
}

/// The largest move of one joint, a meter of torso counted as ten radians (it is as slow).
double effort(const KdlChain& chain, const KDL::JntArray& from, const KDL::JntArray& to) {
  double worst = 0;
  for (std::size_t i = 0; i < chain.joints.size(); ++i) {
    const auto k = static_cast<unsigned>(i);
    const double scale = chain.joints[i]->kind == Joint::Kind::Prismatic ? 10 : 1;
    worst = std::max(worst, scale * std::abs(to(k) - from(k)));
  }
  return worst;
}

std::optional<KDL::JntArray> nearestSolution(const KdlChain& chain, const KDL::Frame& goal,
                                             const KDL::JntArray& seed) {
  // 1 mrad weighs as much as 0.1 mm: both have to be right.
  Eigen::Matrix<double, 6, 1> weights;
  weights << 1, 1, 1, 0.5, 0.5, 0.5;
  KDL::ChainIkSolverPos_LMA solver(chain.chain, weights, 1e-6, 200);
  std::mt19937 random(1);
  std::optional<KDL::JntArray> best;
  int found = 0;
  for (int attempt = 0; attempt < kStarts && found < kEnough; ++attempt) {
    KDL::JntArray q(seed.rows());
    if (solver.CartToJnt(makeStart(chain, seed, attempt, random), goal, q) < 0) continue;
    if (!settle(chain, seed, q)) continue;
    ++found;
    if (!best || effort(chain, seed, q) < effort(chain, seed, *best)) best = q;
  }
  return best;
}

/// Returns how far the ray passes the target: 0 on it, 2 pointing the other way.
Eigen::Vector3d missOf(const Eigen::Isometry3d& T_root_frame, const Eigen::Vector3d& direction,
                       const Eigen::Vector3d& p_root) {
  return (T_root_frame.inverse() * p_root).normalized() - direction.normalized();
}

/// Gauss-Newton on two angles, derivatives by differences. Empty if it does not get there.
template <typename Miss>
std::optional<Eigen::Vector2d> refineAim(const Miss& missAt, Eigen::Vector2d q) {
  constexpr double kNudge = 1e-6;
  for (int i = 0; i < 30; ++i) {
    const Eigen::Vector3d miss = missAt(q);
    if (miss.norm() < 1e-7) return q;
    Eigen::Matrix<double, 3, 2> slope;
    for (int k = 0; k < 2; ++k) {
      const Eigen::Vector2d aside = q + kNudge * Eigen::Vector2d::Unit(k);
      slope.col(k) = (missAt(aside) - miss) / kNudge;
    }
    Eigen::Vector2d step = slope.colPivHouseholderQr().solve(miss);
    const double longest = step.cwiseAbs().maxCoeff();
    if (longest > 0.5) step *= 0.5 / longest;
    q -= step;
  }
  return std::nullopt;
}

}  // namespace

std::optional<JointPositions> RobotModel::solveIk(const std::string& tip_link,
                                                  const Eigen::Isometry3d& T_root_tip,
                                                  const JointPositions& seed,
                                                  const std::set<std::string>& held) const {
  const std::vector<const Joint*> path = chainTo(tip_link);
  JointPositions all = restPositions();
  for (const auto& [name, position] : seed) all[name] = position;
  const KdlChain chain = makeKdlChain(path, all, held);
  KDL::JntArray from(static_cast<unsigned>(chain.joints.size()));
  for (std::size_t i = 0; i < chain.joints.size(); ++i)
    from(static_cast<unsigned>(i)) = all.at(chain.joints[i]->name);
  const auto solution = nearestSolution(chain, toKdl(T_root_tip), from);
  if (!solution) return std::nullopt;
  JointPositions result;
  for (const Joint* joint : path)
    if (joint->moves()) result[joint->name] = all.at(joint->name);
  for (std::size_t i = 0; i < chain.joints.size(); ++i)
    result[chain.joints[i]->name] = (*solution)(static_cast<unsigned>(i));
  return result;
}

std::optional<JointPositions> RobotModel::aim(const PanTilt& turret,
                                              const Eigen::Vector3d& direction,
                                              const Eigen::Vector3d& p_root,
                                              const JointPositions& positions) const {
  const Joint *pan = &joint(turret.pan_joint), *tilt = &joint(turret.tilt_joint);
  const auto missAt = [&](const Eigen::Vector2d& q) {
    JointPositions all = positions;
    all[pan->name] = q[0], all[tilt->name] = q[1];
    return missOf(linkPose(turret.frame, all), direction, p_root);
  };
  const Eigen::Vector2d lower(pan->lower, tilt->lower), upper(pan->upper, tilt->upper);
  const Eigen::Vector2d now(positionOf(*pan, positions), positionOf(*tilt, positions));
  for (const Eigen::Vector2d& start : {now, Eigen::Vector2d(0, 0)}) {
    const std::optional<Eigen::Vector2d> q = refineAim(missAt, start);
    if (q && (q->array() >= lower.array()).all() && (q->array() <= upper.array()).all())
      return JointPositions{{pan->name, (*q)[0]}, {tilt->name, (*q)[1]}};
  }
  return std::nullopt;
}

}  // namespace afterglow::nodes
