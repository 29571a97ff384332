#include "calib/mount/mount.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>

#include "calib/number_text.hpp"

namespace afterglow::calib {
namespace {

/// A pose within the limits still is an outlier when it is so many times as far off as any other
/// (and not merely one of four that agree to a hair).
constexpr double kOutlierRatio = 4, kOutlierShare = 0.3;

Rigid<Link, Projector> meanPose(const std::vector<MountPose>& poses) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  std::vector<Eigen::Quaterniond> rotations;
  for (const MountPose& pose : poses) {
    sum += pose.T_link_projector.matrix().translation();
    rotations.emplace_back(pose.T_link_projector.matrix().linear());
    rotations.back().normalize();
  }
  Eigen::Isometry3d mean = Eigen::Isometry3d::Identity();
  mean.linear() = meanRotation(rotations).toRotationMatrix();
  mean.translation() = sum / static_cast<double>(poses.size());
  return Rigid<Link, Projector>(mean);
}

MountDeviation deviation(const MountPose& pose, const Rigid<Link, Projector>& mean) {
  const Eigen::Isometry3d& T = pose.T_link_projector.matrix();
  const Eigen::Quaterniond from(mean.matrix().linear()), to(T.linear());
  return {pose.name, 1000 * (T.translation() - mean.matrix().translation()).norm(),
          from.angularDistance(to) * 180 / M_PI, true};
}

/// The deviation in units of the limits.
double scaled(const MountDeviation& deviation, const MountLimits& limits) {
  return std::max(deviation.mm / limits.mm, deviation.deg / limits.deg);
}

double worstScaled(const std::vector<MountPose>& poses, const MountLimits& limits) {
  const Rigid<Link, Projector> mean = meanPose(poses);
  double worst = 0;
  for (const MountPose& pose : poses) {
    worst = std::max(worst, scaled(deviation(pose, mean), limits));
  }
  return worst;
}

std::vector<MountPose> without(const std::vector<MountPose>& poses, std::size_t left_out) {
  std::vector<MountPose> rest = poses;
  rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(left_out));
  return rest;
}

/// The pose without which the others agree best, if they contradict it.
std::optional<std::size_t> findOutlier(const std::vector<MountPose>& poses,
                                       const MountLimits& limits) {
  if (poses.size() < 3) return std::nullopt;
  std::size_t odd = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const double worst = worstScaled(without(poses, i), limits);
    if (worst < least) {
      least = worst;
      odd = i;
    }
  }
  const bool is_within = worstScaled(poses, limits) <= 1;
  if (is_within && poses.size() < 4) return std::nullopt;
  const double off = scaled(deviation(poses[odd], meanPose(without(poses, odd))), limits);
  const bool is_odd = is_within ? off > kOutlierShare && off > kOutlierRatio * least : least <= 1;
  return is_odd ? std::optional(odd) : std::nullopt;
}

std::string contradiction(const Mount& mount, const MountLimits& limits) {
  std::vector<std::string> off;
  for (const MountDeviation& pose : mount.poses) {
    off.push_back(pose.name + " " + fixedText(pose.mm, 1) + " mm " + fixedText(pose.deg, 2) +
                  " deg");
  }
  return fmt::format(
      "the poses contradict each other; from their mean, where {} mm and {} deg are allowed: {}; "
      "check that each camera transform is of the moment of its calibration, and that the link "
      "carries the projector",
      fixedText(limits.mm, 1), fixedText(limits.deg, 2), fmt::join(off, ", "));
}

void setSpread(Mount& mount) {
  double mm = 0, deg = 0;
  int used = 0;
  for (const MountDeviation& pose : mount.poses) {
    if (!pose.is_used) continue;
    mm += pose.mm * pose.mm;
    deg += pose.deg * pose.deg;
    ++used;
  }
  if (used < 2) return;
  mount.spread_mm = std::sqrt(mm / used);
  mount.spread_deg = std::sqrt(deg / used);
}

Eigen::Quaterniond rotationOf(const Mount& mount) {
  Eigen::Quaterniond q(mount.T_link_projector.matrix().linear());
  q.normalize();
  if (q.w() < 0) q.coeffs() *= -1;
  return q;
}

std::string spreadText(const std::optional<double>& spread, int decimals) {
  return spread ? fixedText(*spread, decimals) : "~";
}

}  // namespace

Eigen::Quaterniond meanRotation(const std::vector<Eigen::Quaterniond>& rotations) {
  if (rotations.empty()) throw std::invalid_argument("the mean of no rotations");
  Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
  for (const Eigen::Quaterniond& q : rotations) sum += q.coeffs() * q.coeffs().transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> solver(sum);
  Eigen::Quaterniond mean;
  mean.coeffs() = solver.eigenvectors().col(3);  // eigenvalues ascend
  if (mean.w() < 0) mean.coeffs() *= -1;
  return mean;
}

Mount averageMount(const std::vector<MountPose>& poses, const MountLimits& limits) {
  if (poses.empty()) throw std::invalid_argument("no pose to average");
  const std::optional<std::size_t> outlier = findOutlier(poses, limits);
  Mount mount;
  mount.T_link_projector = meanPose(outlier ? without(poses, *outlier) : poses);
  double worst = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    mount.poses.push_back(deviation(poses[i], mount.T_link_projector));
    mount.poses.back().is_used = i != outlier;
    if (i != outlier) worst = std::max(worst, scaled(mount.poses.back(), limits));
  }
  if (worst > 1) throw MountRefused(contradiction(mount, limits));
  setSpread(mount);
  return mount;
}

std::string staticTransformYaml(const Mount& mount, const MountFrames& frames) {
  const Eigen::Vector3d t = mount.T_link_projector.matrix().translation();
  const Eigen::Quaterniond q = rotationOf(mount);
  std::string text = fmt::format(
      "# From the link to the projector, by `afterglow calibrate mount`.\n"
      "parent_frame: {}\nchild_frame: {}\ntranslation: {{x: {}, y: {}, z: {}}}  # m\n"
      "rotation: {{x: {}, y: {}, z: {}, w: {}}}\nspread_mm: {}\nspread_deg: {}\nposes:\n",
      yamlText(frames.link), yamlText(frames.projector), exactText(t.x()), exactText(t.y()),
      exactText(t.z()), exactText(q.x()), exactText(q.y()), exactText(q.z()), exactText(q.w()),
      spreadText(mount.spread_mm, 3), spreadText(mount.spread_deg, 4));
  for (const MountDeviation& pose : mount.poses) {
    text += fmt::format("  - {{name: {}, deviation_mm: {}, deviation_deg: {}, used: {}}}\n",
                        yamlText(pose.name), fixedText(pose.mm, 3), fixedText(pose.deg, 4),
                        pose.is_used);
  }
  return text;
}

std::string staticTransformLaunch(const Mount& mount, const MountFrames& frames,
                                  bool has_publisher) {
  for (const std::string& name : {frames.link, frames.projector}) {
    if (!isFrameName(name)) throw std::invalid_argument("'" + name + "' is no tf2 frame name");
  }
  const Eigen::Vector3d t = mount.T_link_projector.matrix().translation();
  const Eigen::Quaterniond q = rotationOf(mount);
  std::string arguments;
  for (const double number : {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()}) {
    arguments += exactText(number) + " ";
  }
  arguments += frames.link + " " + frames.projector;
  const auto node = [&](const std::string& condition, const std::string& program) {
    return "  <node " + condition + "=\"$(arg tf2_ros)\" " + program +
           " name=\"projector_tf\"\n        args=\"" + arguments + "\"/>\n";
  };
  return std::string(
             "<?xml version=\"1.0\"?>\n"
             "<launch>\n"
             "  <!-- Where the projector sits on the robot, by `afterglow calibrate mount`:\n"
             "       x y z qx qy qz qw parent child -->\n"
             "  <arg name=\"tf2_ros\" default=\"") +
         (has_publisher ? "true" : "false") +
         "\"\n       doc=\"false where tf2_ros has no static_transform_publisher, as on Debian "
         "12\"/>\n" +
         node("if", "pkg=\"tf2_ros\" type=\"static_transform_publisher\"") +
         node("unless", "pkg=\"afterglow\" type=\"static_transform_node\"") + "</launch>\n";
}

bool isFrameName(const std::string& name) {
  if (name.empty() || name.front() == '/') return false;
  return std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return c < 128 && (std::isalnum(c) != 0 || c == '_' || c == '-' || c == '.' || c == '/');
  });
}

}  // namespace afterglow::calib
