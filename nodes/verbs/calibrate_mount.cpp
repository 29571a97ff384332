#include "nodes/verbs/command.hpp"

#include <fmt/format.h>

#include <CLI/Error.hpp>
#include <CLI/Option.hpp>
#include <CLI/Validators.hpp>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>

#include "calib/file_replacement.hpp"
#include "calib/mount/mount.hpp"
#include "calib/report/calibration_files.hpp"
#include "nodes/tools/mount_poses.hpp"
#include "nodes/tools/yaml_map.hpp"
#include "nodes/verbs/transform_question.hpp"
#include "nodes/verbs/verb_tools.hpp"

namespace afterglow::nodes {
namespace {

namespace fs = std::filesystem;

struct CalibrateMountOptions {
  std::string calibration;
  std::string poses;
  std::vector<double> camera_tf;
  std::string from_tf;
  std::string add_to;
  std::string name;
  std::string link;
  std::string camera_frame;
  std::string projector_frame;
  std::string out;
  calib::MountLimits limits;
  bool json = false;
};

constexpr double kPatience_s = 5;

/// A frame that T_camera_projector.yaml names; empty if it does not.
std::string frameIn(const std::string& calibration, const std::string& key) {
  const YAML::Node file = loadYaml((fs::path(calibration) / "T_camera_projector.yaml").string());
  if (!file.IsMap() || !file[key] || !file[key].IsScalar()) return "";
  return file[key].Scalar();
}

Rigid<Link, Camera> cameraOnLink(const CalibrateMountOptions& options) {
  if (options.from_tf.empty()) {
    return Rigid<Link, Camera>(poseFromNumbers(options.camera_tf, "--camera-tf"));
  }
  const std::string camera = !options.camera_frame.empty()
                                 ? options.camera_frame
                                 : frameIn(options.calibration, "parent_frame");
  if (camera.empty()) {
    throw std::runtime_error(options.calibration +
                             "/T_camera_projector.yaml names no parent_frame: give --camera-frame");
  }
  return Rigid<Link, Camera>(askTransform(options.from_tf, camera, kPatience_s));
}

/// The poses to average; the one given by options is kept in the file, if one is named.
std::vector<MountRecord> gatherPoses(const CalibrateMountOptions& options) {
  if (!options.poses.empty()) return loadMountRecords(options.poses);
  MountRecord record;
  record.name = !options.name.empty()
                    ? options.name
                    : fs::weakly_canonical(options.calibration).filename().string();
  record.T_camera_projector = calib::loadTCameraProjector(
      (fs::path(options.calibration) / "T_camera_projector.yaml").string());
  record.T_link_camera = cameraOnLink(options);
  if (options.add_to.empty()) return {record};
  addMountRecord(options.add_to, record);
  return loadMountRecords(options.add_to);
}

/// Whether this machine's tf2_ros has the program that the launch file would start.
bool hasStaticTransformPublisher() {
  std::string folders = "/usr:/opt/ros/noetic";
  if (const char* value = std::getenv("CMAKE_PREFIX_PATH")) folders += ":" + std::string(value);
  std::istringstream stream(folders);
  for (std::string folder; std::getline(stream, folder, ':');) {
    std::error_code ignored;
    const fs::path program = fs::path(folder) / "lib/tf2_ros/static_transform_publisher";
    if (fs::exists(program, ignored)) return true;
  }
  return false;
}

nlohmann::ordered_json mountJson(const calib::Mount& mount, const calib::MountFrames& frames) {
  const Eigen::Vector3d t = mount.T_link_projector.matrix().translation();
  const Eigen::Quaterniond q(mount.T_link_projector.matrix().linear());
  nlohmann::ordered_json json = {{"parent_frame", frames.link},
                                 {"child_frame", frames.projector},
                                 {"translation", {t.x(), t.y(), t.z()}},
                                 {"rotation", {q.x(), q.y(), q.z(), q.w()}},
                                 {"spread_mm", nullptr},
                                 {"spread_deg", nullptr},
                                 {"poses", nlohmann::ordered_json::array()}};
  if (mount.spread_mm) json["spread_mm"] = *mount.spread_mm;
  if (mount.spread_deg) json["spread_deg"] = *mount.spread_deg;
  for (const calib::MountDeviation& pose : mount.poses) {
    json["poses"].push_back({{"name", pose.name},
                             {"deviation_mm", pose.mm},
                             {"deviation_deg", pose.deg},
                             {"used", pose.is_used}});
  }
  return json;
}

void printMount(const calib::Mount& mount, const CalibrateMountOptions& options) {
  using Align = TextTable::Align;
  TextTable table({{"POSE", Align::Left}, {"MM OFF", Align::Right}, {"DEG OFF", Align::Right}});
  for (const calib::MountDeviation& pose : mount.poses) {
    table.add({pose.name + (pose.is_used ? "" : " (left out)"), fmt::format("{:.2f}", pose.mm),
               fmt::format("{:.3f}", pose.deg)});
  }
  if (mount.poses.size() > 1) std::cout << table.text();
  std::cout << "static_transform.yaml and projector_tf.launch in " << options.out;
  if (mount.spread_mm) {
    std::cout << fmt::format(": the poses agree to {:.2f} mm and {:.3f} deg (rms)\n",
                             *mount.spread_mm, *mount.spread_deg);
  } else {
    std::cout << ": from one pose, with nothing to compare it with\n";
  }
}

void runMount(const CalibrateMountOptions& options) {
  calib::MountFrames frames;
  frames.link = options.from_tf.empty() ? options.link : options.from_tf;
  if (!options.projector_frame.empty()) frames.projector = options.projector_frame;
  for (const std::string& name : {frames.link, frames.projector}) {
    if (calib::isFrameName(name)) continue;
    throw std::runtime_error("'" + name +
                             "' is no tf2 frame name: letters, digits, _ - . and / within");
  }
  std::vector<calib::MountPose> poses;
  for (const MountRecord& record : gatherPoses(options)) poses.push_back(record.pose());
  const calib::Mount mount = calib::averageMount(poses, options.limits);
  const fs::path out(options.out);
  calib::replaceFile((out / "static_transform.yaml").string(),
                     calib::staticTransformYaml(mount, frames));
  calib::replaceFile((out / "projector_tf.launch").string(),
                     calib::staticTransformLaunch(mount, frames, hasStaticTransformPublisher()));
  for (const calib::MountDeviation& pose : mount.poses) {
    if (pose.is_used) continue;
    std::cerr << fmt::format(
        "afterglow calibrate mount: left out {}: {:.1f} mm and {:.2f} deg from the others\n",
        pose.name, pose.mm, pose.deg);
  }
  if (options.json) {
    std::cout << dumpJson(mountJson(mount, frames), 2) << "\n";
  } else {
    printMount(mount, options);
  }
}

/// What CLI11's needs and excludes cannot say: exactly one way to know where the camera is.
void checkUsage(const CalibrateMountOptions& options) {
  const bool has_list = !options.poses.empty();
  const int ways =
      (has_list ? 1 : 0) + (options.camera_tf.empty() ? 0 : 1) + (options.from_tf.empty() ? 0 : 1);
  if (ways != 1) {
    throw CLI::ValidationError("mount", "give one of --camera-tf, --from-tf and --poses");
  }
  if (has_list == !options.calibration.empty()) {
    throw CLI::ValidationError("mount",
                               "--calibration goes with --camera-tf or --from-tf; the "
                               "file of --poses names its own");
  }
  if (options.link.empty() == options.from_tf.empty()) {
    throw CLI::ValidationError("mount", "name the link: with --link, or by --from-tf");
  }
}

void addSources(CLI::App& verb, CalibrateMountOptions& options) {
  verb.add_option("--calibration", options.calibration,
                  "Folder of a calibration (T_camera_projector.yaml)");
  verb.add_option("--camera-tf", options.camera_tf,
                  "Where the camera's optical frame was in the link: x,y,z,qx,qy,qz,qw (as "
                  "tf_echo LINK CAMERA prints it)")
      ->delimiter(',')
      ->expected(7);
  verb.add_option("--from-tf", options.from_tf,
                  "Ask the running robot where the camera is now in this link");
  verb.add_option("--poses", options.poses,
                  "YAML of several poses of the turret, each with its calibration and camera tf");
  verb.add_option("--add-to", options.add_to,
                  "Keep this pose in a file as --poses reads it, and average all that it holds")
      ->excludes("--poses");
  verb.add_option("--name", options.name, "What to call this pose; default: its folder's name")
      ->excludes("--poses");
  verb.add_option("--camera-frame", options.camera_frame,
                  "The camera's optical frame in tf; default: what the calibration says")
      ->needs("--from-tf");
}

}  // namespace

void addCalibrateMount(CLI::App& calibrate) {
  auto options = std::make_shared<CalibrateMountOptions>();
  CLI::App* verb = calibrate.add_subcommand(
      "mount", "From calibrations and tf: the static transform from a link to the projector");
  addSources(*verb, *options);
  verb->add_option("--link", options->link,
                   "The link that carries the projector, the new transform's parent");
  verb->add_option("--projector-frame", options->projector_frame,
                   "The new transform's child; default projector_optical_frame");
  verb->add_option("--out", options->out, "Folder for static_transform.yaml, projector_tf.launch")
      ->required();
  verb->add_option("--limit-mm", options->limits.mm, "Farthest a pose may be from the mean")
      ->check(CLI::Range(0.01, 1000.0))
      ->capture_default_str();
  verb->add_option("--limit-deg", options->limits.deg, "Farthest it may be turned from the mean")
      ->check(CLI::Range(0.001, 90.0))
      ->capture_default_str();
  verb->add_flag("--json", options->json, "What was found, as JSON");
  verb->callback([options] {
    checkUsage(*options);
    runMount(*options);
  });
}

}  // namespace afterglow::nodes
