#include "nodes/verbs/command.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/Validators.hpp>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <thread>

#include "calib/camera_info_file.hpp"
#include "calib/report/calibration_yaml.hpp"
#include "calib/solver/solve.hpp"
#include "calib/targets/target_files.hpp"
#include "nodes/tools/calibration_folder.hpp"
#include "nodes/verbs/terminal_text.hpp"
#include "nodes/verbs/verb_tools.hpp"
#include "nodes/verbs/view_pictures.hpp"

namespace afterglow::nodes {
namespace {

struct CalibrateSolveOptions {
  std::string images, board, pattern, camera, out;
  calib::CalibrationNames names;
  std::optional<double> ruler_mm;
  bool refines_camera = false, fixes_camera = false;
  bool json = false;
};

/// One line on stderr, if that is a terminal.
calib::CalibrationProgress terminalProgress() {
  if (isatty(STDERR_FILENO) != 1) return {};
  return [](const std::string& doing, double share) {
    replaceLine(fmt::format("{}, {:.0f} %", doing, 100 * share));
    if (share >= 1) replaceLine("");
  };
}

nlohmann::ordered_json solutionJson(const calib::Calibration& calibration) {
  nlohmann::ordered_json json;
  json["held_out_rms_px"] = calibration.held_out_rms_px;
  json["held_out_rms_mm"] = calibration.held_out_rms_mm;
  json["training_rms_px"] = calibration.training_rms_px;
  json["board_rms_px"] = calibration.board_rms_px;
  json["predicted_mm"] = calibration.predicted_mm;
  const calib::CameraChange& camera = calibration.camera_change;
  json["camera"] = {{"fate", calib::fateName(camera.fate)},
                    {"focal_change", camera.focal},
                    {"center_change_px", {camera.center_px.x(), camera.center_px.y()}},
                    {"largest_change_px", camera.largest_px},
                    {"contradicted", camera.isContradicted()}};
  json["coverage"] = calibration.coverage.share();
  for (const calib::ViewResult& view : calibration.views) {
    nlohmann::ordered_json one;
    one["name"] = view.name;
    one["used"] = view.is_used;
    if (!view.is_used) one["reason"] = view.reason;
    if (view.held_out_px) one["held_out_px"] = *view.held_out_px;
    if (view.held_out_mm) one["held_out_mm"] = *view.held_out_mm;
    json["views"].push_back(one);
  }
  json["warnings"] = calibration.warnings;
  return json;
}

void printSolution(const calib::Calibration& calibration, const CalibrateSolveOptions& options) {
  const calib::Lens& lens = calibration.estimate.projector;
  std::size_t used = 0;
  for (const calib::ViewResult& view : calibration.views) used += view.is_used ? 1 : 0;
  std::cout << fmt::format(
      "Left-out views are predicted to {:.3f} px, {:.3f} mm on the board ({} of {} views used, "
      "{:.0f} % of the picture covered)\nfx {:.2f}  fy {:.2f}  cx {:.2f}  cy {:.2f} px\n",
      calibration.held_out_rms_px, calibration.held_out_rms_mm, used, calibration.views.size(),
      100 * calibration.coverage.share(), lens.K(0, 0), lens.K(1, 1), lens.K(0, 2), lens.K(1, 2));
  std::cout << fmt::format("light is uncertain by {:.3f} mm (95 %) on the boards; {}\n",
                           calibration.predicted_mm,
                           calib::cameraText(calibration.camera_change));
  for (const std::string& warning : calibration.warnings) std::cout << "note: " << warning << "\n";
  std::cout << "projector.yaml, T_camera_projector.yaml, camera.yaml, calibration.yaml and "
               "report.html in "
            << options.out << "\n";
}

void runSolve(const CalibrateSolveOptions& options) {
  const calib::Board board = calib::loadBoard(options.board);
  const calib::Pattern pattern = calib::loadPattern(options.pattern);
  const calib::CameraInfoFile camera = calib::loadCameraInfo(options.camera);
  if (!camera.warning.empty()) {
    std::cerr << "afterglow calibrate solve: " << options.camera << ": " << camera.warning << "\n";
  }
  std::vector<calib::Photographs> photographs;
  for (const ViewFiles& files : findViews(options.images)) {
    photographs.push_back(loadPhotographs(files));
  }
  const CalibrationFolder folder(options.out);
  folder.make();
  calib::SolveOptions solve;
  if (options.refines_camera) solve.camera_use = calib::CameraUse::Refine;
  if (options.fixes_camera) solve.camera_use = calib::CameraUse::Hold;
  solve.threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  if (options.ruler_mm) solve.measured_ruler_m = *options.ruler_mm / 1000;
  try {
    const calib::Calibration calibration = calib::solvePhotographs(
        photographs, board, pattern, camera.lens, solve, terminalProgress());
    calib::CalibrationNames names = options.names;
    if (!camera.name.empty()) names.camera_name = camera.name;
    folder.save(calibration, photographs, {names, board, pattern});
    if (options.json) {
      std::cout << dumpJson(solutionJson(calibration), 2) << "\n";
    } else {
      printSolution(calibration, options);
    }
  } catch (const calib::CalibrationRefused& refused) {
    folder.saveRefusal(refused, photographs);
    throw std::runtime_error(std::string(refused.what()) + " (pictures: " + options.out +
                             "/report.html)");
  } catch (const std::invalid_argument& error) {  // pictures not of the camera's size
    throw std::runtime_error(options.images + ": " + error.what());
  }
}

}  // namespace

void addCalibrateSolve(CLI::App& calibrate) {
  auto options = std::make_shared<CalibrateSolveOptions>();
  CLI::App* verb = calibrate.add_subcommand(
      "solve", "Calibrate from photographs: projector.yaml, T_camera_projector.yaml, report.html");
  verb->add_option("--images", options->images,
                   "Folder of view_NN.png (pattern shown) and view_NN_plain.png (plain gray shown)")
      ->required();
  verb->add_option("--board", options->board, "The board's board.yaml")->required();
  verb->add_option("--pattern", options->pattern, "The pattern's pattern.yaml")->required();
  verb->add_option("--camera", options->camera, "The camera's camera_info file")->required();
  verb->add_option("--out", options->out, "Folder for the result; made if it is not there")
      ->required();
  verb->add_option("--ruler-mm", options->ruler_mm,
                   "What the board's printed ruler measures; a wrong print is refused")
      ->check(CLI::PositiveNumber);
  CLI::Option* refine = verb->add_flag(
      "--refine-camera", options->refines_camera,
      "Estimate the camera's lens even if the pictures agree with its camera_info; without this "
      "or --fix-camera it is estimated where they contradict it");
  verb->add_flag("--fix-camera", options->fixes_camera,
                 "Take the camera_info as exact, whatever the pictures say")
      ->excludes(refine);
  verb->add_option("--camera-frame", options->names.camera_frame, "tf frame of the camera")
      ->capture_default_str();
  verb->add_option("--projector-frame", options->names.projector_frame, "tf frame of the projector")
      ->capture_default_str();
  verb->add_flag("--json", options->json, "As JSON");
  verb->callback([options] { runSolve(*options); });
}

}  // namespace afterglow::nodes
