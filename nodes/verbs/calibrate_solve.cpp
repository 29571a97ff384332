#include "nodes/verbs/command.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/Error.hpp>
#include <CLI/Validators.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <thread>

#include "calib/camera_info_file.hpp"
#include "calib/gray_code/gray_code_views.hpp"
#include "calib/report/calibration_files.hpp"
#include "calib/solver/solve.hpp"
#include "calib/targets/target_files.hpp"
#include "nodes/tools/calibration_folder.hpp"
#include "nodes/verbs/terminal_text.hpp"
#include "nodes/verbs/verb_tools.hpp"
#include "nodes/verbs/view_pictures.hpp"

namespace afterglow::nodes {
namespace {

struct CalibrateSolveOptions {
  std::string images, board, pattern, camera, start, out;
  std::string gray_code, chessboard, projector;  ///< other people's photographs
  std::optional<double> square_mm;
  int code_step = 1;
  calib::CalibrationNames names;
  std::optional<double> ruler_mm;
  bool refines_camera = false, fixes_camera = false;
  bool json = false;
};

/// Prints a line on stderr, if that is a terminal.
calib::CalibrationProgress terminalProgress() {
  if (isatty(STDERR_FILENO) != 1) return {};
  const auto begin = std::chrono::steady_clock::now();
  return [begin](const std::string& doing, double share) {
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begin;
    const std::string left = timeLeft(share, taken.count());
    replaceLine(fmt::format("{}, {:.0f} %{}", doing, 100 * share, left.empty() ? "" : ", " + left));
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
  json["light"] = nlohmann::ordered_json::array();
  for (const calib::LightError& error : calibration.light) {
    json["light"].push_back({{"distance_m", error.distance_m},
                             {"mm", error.mm},
                             {"px", error.px},
                             {"bound_mm", error.bound_mm}});
  }
  json["print_mm_per_permille"] = calibration.print_mm_per_permille;
  json["board"] = {{"bend_across_mm", 1000 * calibration.board_shape.bends().x()},
                   {"bend_down_mm", 1000 * calibration.board_shape.bends().y()},
                   {"twist_mm", 1000 * calibration.board_shape.twist()},
                   {"stretch", calibration.board_shape.parameters[0]}};
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
  const std::string light = calib::lightText(calibration);
  if (!light.empty()) std::cout << light << "\n";
  std::cout << fmt::format(
      "Left-out views are predicted to {:.3f} px, {:.3f} mm on the board ({} of {} views used, "
      "{:.0f} % of the picture covered)\nfx {:.2f}  fy {:.2f}  cx {:.2f}  cy {:.2f} px\n",
      calibration.held_out_rms_px, calibration.held_out_rms_mm, used, calibration.views.size(),
      100 * calibration.coverage.share(), lens.K(0, 0), lens.K(1, 1), lens.K(0, 2), lens.K(1, 2));
  std::cout << (calibration.camera_info.width > 0 ? calib::cameraText(calibration.camera_change)
                                                  : "the camera was estimated with the projector")
            << "\n";
  for (const std::string& warning : calibration.warnings) std::cout << "note: " << warning << "\n";
  std::cout << "projector.yaml, T_camera_projector.yaml, camera.yaml, calibration.yaml and "
               "report.html in "
            << options.out << "\n";
}

/// --camera, or, with --start, that calibration's own: calib::cameraOf.
calib::Lens cameraFor(const CalibrateSolveOptions& options, calib::CalibrationNames& names) {
  std::optional<calib::Lens> given;
  if (!options.camera.empty()) {
    const calib::CameraInfoFile file = calib::loadCameraInfo(options.camera);
    if (!file.warning.empty()) {
      std::cerr << "afterglow calibrate solve: " << options.camera << ": " << file.warning << "\n";
    }
    if (!file.name.empty()) names.camera_name = file.name;
    given = file.lens;
  }
  return options.start.empty() ? *given : calib::cameraOf(options.start, given);
}

calib::ProjectorEstimate startOf(const std::string& folder, const calib::Pattern& pattern) {
  const calib::ProjectorEstimate start = calib::loadCalibration(folder);
  if (start.covariance.isZero(0)) {
    throw std::runtime_error(folder + ": has no calibration.yaml, which says how sure it is");
  }
  if (start.projector.width != pattern.width || start.projector.height != pattern.height) {
    throw std::runtime_error(fmt::format("{}: is of {} x {} px, the pattern of {} x {}", folder,
                                         start.projector.width, start.projector.height,
                                         pattern.width, pattern.height));
  }
  return start;
}

/// "9x7". Throws std::runtime_error naming the option.
Eigen::Vector2i sizeOf(const std::string& text, const char* option, int least, int most) {
  Eigen::Vector2i size(0, 0);
  char rest = 0;
  if (std::sscanf(text.c_str(), "%dx%d%c", &size.x(), &size.y(), &rest) == 2 &&
      size.minCoeff() >= least && size.maxCoeff() <= most) {
    return size;
  }
  throw std::runtime_error(fmt::format("{}: {} is not COLUMNSxROWS of {} to {}", option, text,
                                       least, most));
}

/// The set to solve, with what reads its views.
struct SolveInput {
  calib::Board board;
  calib::Pattern pattern;
  calib::Lens camera;
  std::vector<calib::Photographs> photographs;
  std::vector<calib::View> views;  ///< views of Gray codes; empty for tags
};

SolveInput tagInput(const CalibrateSolveOptions& options, calib::CalibrationNames& names) {
  SolveInput input;
  input.board = calib::loadBoard(options.board);
  input.pattern = calib::loadPattern(options.pattern);
  input.camera = cameraFor(options, names);
  for (const ViewFiles& files : findViews(options.images)) {
    input.photographs.push_back(loadPhotographs(files));
  }
  return input;
}

SolveInput grayCodeInput(const CalibrateSolveOptions& options, int threads,
                         calib::CalibrationNames& names) {
  calib::GrayCodeOptions gray;
  const Eigen::Vector2i corners = sizeOf(options.chessboard, "--chessboard", 3, 50);
  const Eigen::Vector2i projector = sizeOf(options.projector, "--projector", 64, 8192);
  gray.folder = options.gray_code;
  gray.chessboard = {corners.x(), corners.y(), *options.square_mm / 1000};
  gray.width = projector.x();
  gray.height = projector.y();
  gray.step = options.code_step;
  if (!options.camera.empty()) gray.camera = cameraFor(options, names);
  gray.threads = threads;
  const calib::GrayCodeViews set = calib::readGrayCode(gray);
  if (!gray.camera && !options.json) {
    std::cout << "No --camera: its lens is estimated from the chessboards themselves\n";
  }
  return {set.board, set.pattern, set.camera, set.photographs, set.views};
}

calib::SolveOptions solverOptions(const CalibrateSolveOptions& options,
                                  const calib::Pattern& pattern, int threads) {
  calib::SolveOptions solve;
  if (options.refines_camera || options.camera.empty()) {
    solve.camera_use = calib::CameraUse::Refine;
  }
  if (!options.start.empty()) {
    solve.start = startOf(options.start, pattern);
    if (!options.refines_camera) solve.camera_use = calib::CameraUse::RefineIfContradicted;
  }
  if (options.fixes_camera) solve.camera_use = calib::CameraUse::Hold;
  solve.threads = threads;
  if (options.ruler_mm) solve.measured_ruler_m = *options.ruler_mm / 1000;
  return solve;
}

/// Forgets the camera_info: without a file there is nothing to warn of, or to compare with.
void forgetCameraFile(calib::Calibration& calibration) {
  std::vector<std::string>& warnings = calibration.warnings;
  for (const std::string& about_file :
       calib::cameraWarnings(calibration.camera_info, calibration.camera_change)) {
    warnings.erase(std::remove(warnings.begin(), warnings.end(), about_file), warnings.end());
  }
  calibration.camera_info = {};
}

void requireOptions(const CalibrateSolveOptions& options) {
  if (!options.gray_code.empty()) return;
  if (options.images.empty()) throw CLI::RequiredError("--images");
  if (options.board.empty()) throw CLI::RequiredError("--board");
  if (options.pattern.empty()) throw CLI::RequiredError("--pattern");
  if (options.camera.empty() && options.start.empty()) throw CLI::RequiredError("--camera");
}

void runSolve(const CalibrateSolveOptions& options) {
  requireOptions(options);
  const int threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  const bool is_gray_code = !options.gray_code.empty();
  calib::CalibrationNames names = options.names;
  const SolveInput input =
      is_gray_code ? grayCodeInput(options, threads, names) : tagInput(options, names);
  const CalibrationFolder folder(options.out);
  folder.make();
  const calib::SolveOptions solve = solverOptions(options, input.pattern, threads);
  try {
    calib::Calibration calibration =
        is_gray_code ? calib::solveViews(input.views, input.board, input.pattern, input.camera,
                                         solve, terminalProgress())
                     : calib::solvePhotographs(input.photographs, input.board, input.pattern,
                                               input.camera, solve, terminalProgress());
    if (options.camera.empty() && options.start.empty()) forgetCameraFile(calibration);
    folder.save(calibration, input.photographs, {names, input.board, input.pattern});
    if (options.json) {
      std::cout << dumpJson(solutionJson(calibration), 2) << "\n";
    } else {
      printSolution(calibration, options);
    }
  } catch (const calib::CalibrationRefused& refused) {
    folder.saveRefusal(refused, input.photographs);
    throw std::runtime_error(std::string(refused.what()) + " (pictures: " + options.out +
                             "/report.html)");
  } catch (const std::invalid_argument& error) {  // pictures not of the camera's size
    throw std::runtime_error((is_gray_code ? options.gray_code : options.images) + ": " +
                             error.what());
  }
}

/// Photographs of other programs.
void addGrayCodeOptions(CLI::App& verb, CalibrateSolveOptions& options) {
  CLI::Option* const gray_code = verb.add_option(
      "--gray-code", options.gray_code,
      "Instead of --images, --board and --pattern: folder of Gray codes photographed on a "
      "chessboard, as kamino410/procam-calibration (capture_*/graycode_NN.png) or Brown "
      "University's tool (POSE/cam_NN.png) keep them");
  for (const char* other : {"--images", "--board", "--pattern", "--start"}) {
    gray_code->excludes(verb.get_option(other));
  }
  CLI::Option* const chessboard =
      verb.add_option("--chessboard", options.chessboard,
                      "COLUMNSxROWS of the chessboard's inner corners, where four squares meet");
  CLI::Option* const square =
      verb.add_option("--square-mm", options.square_mm, "Side of the chessboard's squares")
          ->check(CLI::Range(0.5, 5000.0));
  CLI::Option* const projector = verb.add_option(
      "--projector", options.projector, "WIDTHxHEIGHT of the projector's picture, pixels");
  gray_code->needs(chessboard)->needs(square)->needs(projector);
  for (CLI::Option* option : {chessboard, square, projector}) option->needs(gray_code);
  verb.add_option("--code-step", options.code_step,
                  "Pixels that the finest code is made of: -graycode_step of kamino410's tool")
      ->capture_default_str()
      ->check(CLI::Range(1, 64))
      ->needs(gray_code);
}

}  // namespace

void addCalibrateSolve(CLI::App& calibrate) {
  auto options = std::make_shared<CalibrateSolveOptions>();
  CLI::App* verb = calibrate.add_subcommand(
      "solve", "Calibrate from photographs: projector.yaml, T_camera_projector.yaml, report.html");
  verb->add_option("--images", options->images,
                   "Folder of view_NN.png (pattern shown) and view_NN_plain.png (plain gray "
                   "shown)");
  verb->add_option("--board", options->board, "The board's board.yaml");
  verb->add_option("--pattern", options->pattern, "The pattern's pattern.yaml");
  verb->add_option("--camera", options->camera,
                   "The camera's camera_info file; not needed with --start");
  verb->add_option("--start", options->start,
                   "Folder of an earlier calibration of this projector, which has since warmed up "
                   "or was bumped: five views are enough to refine it");
  addGrayCodeOptions(*verb, *options);
  verb->add_option("--out", options->out, "Folder for the result; made if it is not there")
      ->required();
  verb->add_option("--ruler-mm", options->ruler_mm,
                   "What the board's printed ruler measures; a wrong print is refused")
      ->check(CLI::PositiveNumber);
  CLI::Option* refine = verb->add_flag(
      "--refine-camera", options->refines_camera,
      "Estimate the camera's lens even if the pictures agree with its camera_info; without this "
      "or --trust-camera it is estimated where they contradict it");
  verb->add_flag("--trust-camera,--fix-camera", options->fixes_camera,
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
