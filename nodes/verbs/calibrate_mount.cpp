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
#include <utility>

#include "calib/file_replacement.hpp"
#include "calib/mount/turret_fit.hpp"
#include "calib/number_text.hpp"
#include "calib/report/calibration_files.hpp"
#include "nodes/tools/mount_poses.hpp"
#include "nodes/verbs/verb_node.hpp"
#include "nodes/verbs/verb_tools.hpp"
#include "replay/messages/text.hpp"

namespace afterglow::nodes {
namespace {

namespace fs = std::filesystem;

struct CalibrateMountOptions {
  std::string calibration;
  std::string poses;
  std::vector<double> camera_tf;
  std::string from_tf;
  std::vector<std::string> turret;
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
constexpr char kWantsLink[] = "name the link: with --link, or by --from-tf or --turret";

/// Limits for a turret whose poses do not tell yet how it errs: what its errors may make of a mean.
constexpr calib::MountLimits kUncorrected{60, 10};

std::string cameraFrame(const CalibrateMountOptions& options) {
  return options.camera_frame.empty() ? cameraFrameOf(options.calibration) : options.camera_frame;
}

/// Notes where the camera, and how the turret, if there is one, stands now.
void placeOnRobot(const CalibrateMountOptions& options, MountRecord& record) {
  if (!options.turret.empty()) {
    record.links = options.turret;
    std::vector<std::pair<std::string, std::string>> questions = {
        {options.turret.back(), cameraFrame(options)}};
    for (std::size_t i = 0; i + 1 < options.turret.size(); ++i) {
      questions.emplace_back(options.turret[i], options.turret[i + 1]);
    }
    const std::vector<Eigen::Isometry3d> transforms = askTransforms(questions, kPatience_s);
    record.T_link_camera = Rigid<Link, Camera>(transforms.front());
    record.T_parent_link.assign(transforms.begin() + 1, transforms.end());
  } else if (!options.from_tf.empty()) {
    record.T_link_camera = Rigid<Link, Camera>(
        askTransform(options.from_tf, cameraFrame(options), kPatience_s));
  } else {
    record.T_link_camera = Rigid<Link, Camera>(poseFromNumbers(options.camera_tf, "--camera-tf"));
  }
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
  placeOnRobot(options, record);
  if (options.add_to.empty()) return {record};
  addMountRecord(options.add_to, record);
  return loadMountRecords(options.add_to);
}

/// Returns true if this machine's tf2_ros has the program that the launch file would start.
bool hasStaticTransformPublisher() {
  std::string folders = "/usr:/opt/ros/noetic";
  if (const char* value = std::getenv("CMAKE_PREFIX_PATH")) folders += ":" + std::string(value);
  for (const std::string& folder : replay::splitAt(':', folders)) {
    std::error_code ignored;
    const fs::path program = fs::path(folder) / "lib/tf2_ros/static_transform_publisher";
    if (fs::exists(program, ignored)) return true;
  }
  return false;
}

nlohmann::ordered_json posesJson(const std::vector<calib::MountDeviation>& poses) {
  auto json = nlohmann::ordered_json::array();
  for (const calib::MountDeviation& pose : poses) {
    json.push_back({{"name", pose.name},
                    {"deviation_mm", pose.mm},
                    {"deviation_deg", pose.deg},
                    {"used", pose.is_used}});
  }
  return json;
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
                                 {"poses", posesJson(mount.poses)}};
  if (mount.spread_mm) json["spread_mm"] = *mount.spread_mm;
  if (mount.spread_deg) json["spread_deg"] = *mount.spread_deg;
  return json;
}

nlohmann::ordered_json turretJson(const calib::TurretFit& fit) {
  const auto value = [](const calib::JointError::Value& error) {
    return nlohmann::ordered_json{{"value", error.value}, {"deviation", error.deviation}};
  };
  nlohmann::ordered_json json = {{"parent_frame", fit.turret.joints.front().parent},
                                 {"child_frame", fit.turret.projector_frame},
                                 {"light_mm", fit.light_mm},
                                 {"light_beyond_mm", fit.light_beyond_mm},
                                 {"spread_mm", fit.spread_mm},
                                 {"spread_deg", fit.spread_deg},
                                 {"joints", nlohmann::ordered_json::array()},
                                 {"poses", posesJson(fit.poses)}};
  for (std::size_t i = 0; i < fit.errors.size(); ++i) {
    const calib::JointError& error = fit.errors[i];
    json["joints"].push_back({{"link", fit.turret.joints[i].link},
                              {"span_deg", error.span_deg},
                              {"axis_deg", value(error.axis_deg)},
                              {"axis_mm", value(error.axis_mm)},
                              {"zero_deg", value(error.zero_deg)},
                              {"scale_percent", value(error.scale_percent)}});
  }
  return json;
}

using Align = TextTable::Align;

void printPoses(const std::vector<calib::MountDeviation>& poses) {
  TextTable table({{"POSE", Align::Left}, {"MM OFF", Align::Right}, {"DEG OFF", Align::Right}});
  for (const calib::MountDeviation& pose : poses) {
    table.add({pose.name + (pose.is_used ? "" : " (left out)"), fmt::format("{:.2f}", pose.mm),
               fmt::format("{:.3f}", pose.deg)});
  }
  if (poses.size() > 1) std::cout << table.text();
}

void printMount(const calib::Mount& mount, const CalibrateMountOptions& options) {
  printPoses(mount.poses);
  std::cout << "static_transform.yaml and projector_tf.launch in " << options.out;
  if (mount.spread_mm) {
    std::cout << fmt::format(": the poses agree to {:.2f} mm and {:.3f} deg (rms)\n",
                             *mount.spread_mm, *mount.spread_deg);
  } else {
    std::cout << ": from one pose, with nothing to compare it with\n";
  }
}

void printTurret(const calib::TurretFit& fit, const CalibrateMountOptions& options) {
  printPoses(fit.poses);
  TextTable table({{"JOINT OFF BY", Align::Left},
                   {"TURNED", Align::Right},
                   {"AXIS, DEG", Align::Right},
                   {"AXIS, MM", Align::Right},
                   {"ZERO, DEG", Align::Right},
                   {"SCALE, %", Align::Right}});
  const auto text = [](const calib::JointError::Value& error, int decimals) {
    return calib::fixedText(error.value, decimals) + " +-" +
           calib::fixedText(2 * error.deviation, decimals);
  };
  for (std::size_t i = 0; i < fit.errors.size(); ++i) {
    const calib::JointError& error = fit.errors[i];
    table.add({fit.turret.joints[i].link, fmt::format("{:.0f} deg", error.span_deg),
               text(error.axis_deg, 2), text(error.axis_mm, 1), text(error.zero_deg, 2),
               text(error.scale_percent, 2)});
  }
  std::cout << table.text()
            << fmt::format(
                   "turret.yaml and projector_tf.launch in {}: light at 1.5 m will be off by at "
                   "most {:.1f} mm between the poses' angles, {:.1f} mm up to 45 deg beyond (95 "
                   "%)\n",
                   options.out, fit.light_mm, fit.light_beyond_mm);
}

void tellLeftOut(const std::vector<calib::MountDeviation>& poses) {
  for (const calib::MountDeviation& pose : poses) {
    if (pose.is_used) continue;
    std::cerr << fmt::format(
        "afterglow calibrate mount: left out {}: {:.1f} mm and {:.2f} deg from the others\n",
        pose.name, pose.mm, pose.deg);
  }
}

/// Two files that belong together; that of the other kind is of before, and would mislead.
void writeFiles(const CalibrateMountOptions& options, const std::string& name,
                const std::string& yaml, const std::string& launch) {
  const fs::path out(options.out);
  for (const char* file : {"static_transform.yaml", "turret.yaml"}) {
    std::error_code ignored;
    if (file != name) fs::remove(out / file, ignored);
  }
  calib::replaceFile((out / name).string(), yaml);
  calib::replaceFile((out / "projector_tf.launch").string(), launch);
}

void runStatic(const std::vector<MountRecord>& records, const calib::MountFrames& frames,
               const calib::MountLimits& limits, const CalibrateMountOptions& options) {
  std::vector<calib::MountPose> poses;
  for (const MountRecord& record : records) poses.push_back(record.pose());
  const calib::Mount mount = calib::averageMount(poses, limits);
  writeFiles(options, "static_transform.yaml", calib::staticTransformYaml(mount, frames),
             calib::staticTransformLaunch(mount, frames, hasStaticTransformPublisher()));
  tellLeftOut(mount.poses);
  if (options.json) {
    std::cout << dumpJson(mountJson(mount, frames), 2) << "\n";
  } else {
    printMount(mount, options);
  }
}

void runTurret(const std::vector<MountRecord>& records, const calib::MountFrames& frames,
               const std::vector<std::string>& links, const CalibrateMountOptions& options) {
  std::vector<calib::TurretPose> poses;
  for (const MountRecord& record : records) poses.push_back(record.turretPose());
  if (const auto missing = calib::missingTurns(poses, links); !missing.empty()) {
    std::cerr << fmt::format(
        "afterglow calibrate mount: right near these poses only, until more tell how the turret "
        "errs: {}\n",
        fmt::join(missing, "; "));
    runStatic(records, frames, kUncorrected, options);
    return;
  }
  calib::TurretFit fit = calib::fitTurret(poses, links, options.limits);
  fit.turret.projector_frame = frames.projector;
  writeFiles(options, "turret.yaml", calib::turretYaml(fit.turret, calib::turretRemarks(fit)),
             calib::turretLaunch(fit.turret));
  tellLeftOut(fit.poses);
  if (options.json) {
    std::cout << dumpJson(turretJson(fit), 2) << "\n";
  } else {
    printTurret(fit, options);
  }
}

void requireFrameNames(const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    if (calib::isFrameName(name)) continue;
    throw std::runtime_error("'" + name +
                             "' is no tf2 frame name: letters, digits, _ - . and / within");
  }
}

void runMount(const CalibrateMountOptions& options) {
  calib::MountFrames frames;
  frames.link = options.from_tf.empty() ? options.link : options.from_tf;
  if (!options.projector_frame.empty()) frames.projector = options.projector_frame;
  requireFrameNames({frames.projector});
  requireFrameNames(options.turret);
  if (!frames.link.empty()) requireFrameNames({frames.link});
  const std::vector<MountRecord> records = gatherPoses(options);
  if (!frames.link.empty()) {
    runStatic(records, frames, options.limits, options);
    return;
  }
  const std::vector<std::string> links = turretLinks(records);
  if (links.empty()) throw CLI::ValidationError("mount", kWantsLink);
  requireFrameNames(links);
  frames.link = links.back();
  runTurret(records, frames, links, options);
}

/// Checks what CLI11's needs and excludes cannot say: exactly one way to know where the camera is.
void checkUsage(const CalibrateMountOptions& options) {
  const bool has_list = !options.poses.empty(), has_tf = !options.camera_tf.empty();
  const int ways = (has_list ? 1 : 0) + (has_tf ? 1 : 0) + (options.from_tf.empty() ? 0 : 1) +
                   (options.turret.empty() ? 0 : 1);
  if (ways != 1) {
    throw CLI::ValidationError("mount",
                               "give one of --camera-tf, --from-tf, --turret and --poses");
  }
  if (has_list == !options.calibration.empty()) {
    throw CLI::ValidationError("mount",
                               "--calibration goes with --camera-tf, --from-tf or --turret; the "
                               "file of --poses names its own");
  }
  const bool wants_link = has_tf, knows_link = !has_tf && !has_list;
  if (options.link.empty() ? wants_link : knows_link) {
    throw CLI::ValidationError("mount", kWantsLink);
  }
  if (options.turret.size() == 1) {
    throw CLI::ValidationError("mount", "--turret names the turret's base, and each link it turns");
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
  verb.add_option("--turret", options.turret,
                  "The same of a turret, whose errors its poses then tell, too: its base, and each "
                  "link that a joint turns; the last carries the projector: BASE,PAN,TILT")
      ->delimiter(',');
  verb.add_option("--poses", options.poses,
                  "YAML of several poses of the turret, each with its calibration and camera tf");
  verb.add_option("--add-to", options.add_to,
                  "Keep this pose in a file as --poses reads it, and average all that it holds")
      ->excludes("--poses");
  verb.add_option("--name", options.name, "What to call this pose; default: its folder's name")
      ->excludes("--poses");
  verb.add_option("--camera-frame", options.camera_frame,
                  "The camera's optical frame in tf; default: what the calibration says")
      ->excludes("--camera-tf")
      ->excludes("--poses");
}

}  // namespace

void addCalibrateMount(CLI::App& calibrate) {
  auto options = std::make_shared<CalibrateMountOptions>();
  CLI::App* verb = calibrate.add_subcommand(
      "mount", "From calibrations and tf: where the projector sits on a link, or on a turret");
  addSources(*verb, *options);
  verb->add_option("--link", options->link,
                   "The link that carries the projector, the new transform's parent. With --poses "
                   "of a turret: their mean, as without a turret");
  verb->add_option("--projector-frame", options->projector_frame,
                   "The new transform's child; default projector_optical_frame");
  verb->add_option("--out", options->out,
                   "Folder for projector_tf.launch, and static_transform.yaml or turret.yaml")
      ->required();
  verb->add_option("--limit-mm", options->limits.mm,
                   "Farthest a pose may be from the mean, or from where the turret has it")
      ->check(CLI::Range(0.01, 1000.0))
      ->capture_default_str();
  verb->add_option("--limit-deg", options->limits.deg, "Farthest it may be turned from it")
      ->check(CLI::Range(0.001, 90.0))
      ->capture_default_str();
  verb->add_flag("--json", options->json, "What was found, as JSON");
  verb->callback([options] {
    checkUsage(*options);
    runMount(*options);
  });
}

}  // namespace afterglow::nodes
