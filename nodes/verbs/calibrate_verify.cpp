#include "nodes/verbs/command.hpp"

#include <fmt/format.h>

#include <CLI/Error.hpp>
#include <CLI/Option.hpp>
#include <CLI/Validators.hpp>
#include <algorithm>
#include <iostream>
#include <memory>
#include <optional>
#include <stdexcept>

#include "calib/camera_info_file.hpp"
#include "calib/report/calibration_files.hpp"
#include "calib/targets/target_files.hpp"
#include "calib/verify/throw_picture.hpp"
#include "calib/verify/view_check.hpp"
#include "nodes/tools/calibration_folder.hpp"
#include "nodes/tools/tag_layout_file.hpp"
#include "nodes/verbs/verb_tools.hpp"
#include "nodes/verbs/view_pictures.hpp"

namespace afterglow::nodes {
namespace {

using Align = TextTable::Align;

void addSummary(nlohmann::ordered_json& json, const calib::ErrorSummary& summary) {
  json["corners"] = summary.corners;
  const auto value = [&](double mm) {
    return summary.corners == 0 ? nlohmann::ordered_json() : nlohmann::ordered_json(mm);
  };
  json["median_mm"] = value(summary.median_mm);
  json["p95_mm"] = value(summary.p95_mm);
  json["max_mm"] = value(summary.max_mm);
}

std::string inMm(double mm) { return fmt::format("{:.2f}", mm); }

std::string headline(const calib::ErrorSummary& summary) {
  return fmt::format("median {:.2f} mm, p95 {:.2f} mm, max {:.2f} mm over {} corners\n",
                     summary.median_mm, summary.p95_mm, summary.max_mm, summary.corners);
}

calib::ErrorSummary summaryOf(const std::vector<calib::ViewCheck>& views) {
  std::vector<calib::LandingError> all;
  for (const calib::ViewCheck& view : views) {
    all.insert(all.end(), view.errors.begin(), view.errors.end());
  }
  return calib::summarize(all);
}

/// Reports views of the board: {method: "views", views: [{name, corners, median_mm, p95_mm, max_mm,
/// fault}], corners, median_mm, p95_mm, max_mm}.
nlohmann::ordered_json verifyJson(const std::vector<calib::ViewCheck>& views) {
  nlohmann::ordered_json json = {{"method", "views"}, {"views", nlohmann::ordered_json::array()}};
  for (const calib::ViewCheck& view : views) {
    nlohmann::ordered_json entry = {{"name", view.name}};
    addSummary(entry, calib::summarize(view.errors));
    entry["fault"] = view.fault;
    json["views"].push_back(entry);
  }
  addSummary(json, summaryOf(views));
  return json;
}

std::string verifyText(const std::vector<calib::ViewCheck>& views) {
  TextTable table({{"VIEW", Align::Left},
                   {"CORNERS", Align::Right},
                   {"MEDIAN MM", Align::Right},
                   {"P95", Align::Right},
                   {"MAX", Align::Right}});
  std::string faults;
  for (const calib::ViewCheck& view : views) {
    if (!view.fault.empty()) {
      faults += view.name + ": not measured: " + view.fault + "\n";
      continue;
    }
    const calib::ErrorSummary summary = calib::summarize(view.errors);
    table.add({view.name, std::to_string(summary.corners), inMm(summary.median_mm),
               inMm(summary.p95_mm), inMm(summary.max_mm)});
  }
  const calib::ErrorSummary all = summaryOf(views);
  if (all.corners == 0) return faults;
  return table.text() + faults + headline(all);
}

/// Reports tags thrown on a surface: {method: "targets", printed_tags, printed_rms_px, targets:
/// [{id, seen, dx_mm, dy_mm, error_mm, max_mm}], corners, median_mm, p95_mm, max_mm}. dx and dy are
/// those of the target's middle along the surface's axes; median and so on are of all corners.
nlohmann::ordered_json verifyJson(const calib::ThrowCheck& check) {
  nlohmann::ordered_json json = {{"method", "targets"},
                                 {"printed_tags", check.surface.tags.size()},
                                 {"printed_rms_px", check.surface.rms_px},
                                 {"targets", nlohmann::ordered_json::array()}};
  for (const calib::TargetCheck& target : check.targets) {
    nlohmann::ordered_json entry = {{"id", target.id},     {"seen", target.is_seen},
                                    {"dx_mm", nullptr},    {"dy_mm", nullptr},
                                    {"error_mm", nullptr}, {"max_mm", nullptr}};
    if (target.is_seen) {
      entry["dx_mm"] = target.offset_mm.x();
      entry["dy_mm"] = target.offset_mm.y();
      entry["error_mm"] = target.offset_mm.norm();
      entry["max_mm"] = calib::summarize(target.errors).max_mm;
    }
    json["targets"].push_back(entry);
  }
  addSummary(json, calib::summarize(check.errors()));
  return json;
}

std::string verifyText(const calib::ThrowCheck& check) {
  TextTable table({{"TARGET", Align::Left},
                   {"DX MM", Align::Right},
                   {"DY MM", Align::Right},
                   {"ERROR MM", Align::Right},
                   {"WORST CORNER", Align::Right}});
  for (const calib::TargetCheck& target : check.targets) {
    const std::string id = std::to_string(target.id);
    if (!target.is_seen) {
      table.add({id, "not seen", "", "", ""});
      continue;
    }
    table.add({id, inMm(target.offset_mm.x()), inMm(target.offset_mm.y()),
               inMm(target.offset_mm.norm()), inMm(calib::summarize(target.errors).max_mm)});
  }
  const calib::ErrorSummary all = calib::summarize(check.errors());
  const std::string surface = fmt::format("{} printed tags, fitting to {:.2f} px\n",
                                          check.surface.tags.size(), check.surface.rms_px);
  return table.text() + surface + (all.corners == 0 ? "" : headline(all));
}

struct CalibrateVerifyOptions {
  std::string images, board, pattern;       // fresh views of the board
  std::string targets, photograph, thrown;  // tags thrown on a surface
  bool is_plan = false;
  std::string camera, calibration, out;
  std::optional<double> max_p95_mm;
  bool json = false;
};

/// The calibration's own, or --camera: calib::cameraOf.
calib::Lens cameraFor(const CalibrateVerifyOptions& options) {
  std::optional<calib::Lens> given;
  if (!options.camera.empty()) {
    const calib::CameraInfoFile file = calib::loadCameraInfo(options.camera);
    if (!file.warning.empty()) {
      std::cerr << "afterglow calibrate verify: " << options.camera << ": " << file.warning << "\n";
    }
    given = file.lens;
  }
  if (options.calibration.empty()) return *given;
  return calib::cameraOf(options.calibration, given);
}

void requireGood(const calib::ErrorSummary& summary, const CalibrateVerifyOptions& options) {
  if (!options.max_p95_mm || summary.p95_mm <= *options.max_p95_mm) return;
  throw std::runtime_error(
      fmt::format("the 95th percentile is {:.2f} mm, more than the {:.2f} mm allowed by "
                  "--max-p95-mm: calibrate solve --start refines the calibration with five views",
                  summary.p95_mm, *options.max_p95_mm));
}

// ---------------------------------------------------------------------------- views of the board

/// A calibration fits the photographs that it was solved from, however wrong it is.
calib::View readView(const ViewFiles& files, const calib::ViewReader& reader,
                     const CalibrationFolder& calibration) {
  const calib::Photographs photographs = loadPhotographs(files);
  if (calibration.wasSolvedFrom(photographs.pattern)) {
    throw std::runtime_error(files.pattern +
                             " is one of the photographs that the calibration was solved from, "
                             "which say nothing about it: photograph the board anew");
  }
  try {
    return reader.observe(photographs);
  } catch (const std::invalid_argument& error) {  // not of the camera's size
    throw std::runtime_error(files.pattern + ": " + error.what());
  }
}

void runViews(const CalibrateVerifyOptions& options) {
  const calib::Board board = calib::loadBoard(options.board);
  const calib::Pattern pattern = calib::loadPattern(options.pattern);
  const calib::Lens camera = cameraFor(options);
  const calib::ProjectorEstimate estimate = calib::loadCalibration(options.calibration);
  if (estimate.projector.width != pattern.width || estimate.projector.height != pattern.height) {
    throw std::runtime_error(options.pattern + " is of " + std::to_string(pattern.width) + " x " +
                             std::to_string(pattern.height) + " pixels, the projector of " +
                             options.calibration + " has " +
                             std::to_string(estimate.projector.width) + " x " +
                             std::to_string(estimate.projector.height));
  }
  const calib::ViewReader reader(board, pattern, camera);
  std::vector<calib::ViewCheck> views;
  {
    const std::vector<ViewFiles> found = findViews(options.images);
    Progress progress("measuring", "views");
    for (const ViewFiles& files : found) {
      progress.update(views.size(), found.size());
      const calib::View view = readView(files, reader, CalibrationFolder(options.calibration));
      views.push_back(calib::checkView(view, board, pattern, camera, estimate));
    }
  }
  std::cout << (options.json ? dumpJson(verifyJson(views), 2) + "\n" : verifyText(views));
  const calib::ErrorSummary summary = summaryOf(views);
  if (summary.corners == 0) {
    throw std::runtime_error("no view in " + options.images + " could be measured: " +
                             views.front().name + ": " + views.front().fault);
  }
  requireGood(summary, options);
}

// ----------------------------------------------------------------------- tags thrown on a surface

calib::TagLayout loadTargets(const std::string& path) {
  calib::TagLayout layout = loadTagLayout(path);
  if (layout.targets.empty()) throw std::runtime_error(path + ": no 'targets': nothing to throw");
  return layout;
}

void runPlan(const CalibrateVerifyOptions& options) {
  const calib::TagLayout layout = loadTargets(options.targets);
  const calib::Lens camera = cameraFor(options);
  const calib::ProjectorEstimate estimate = calib::loadCalibration(options.calibration);
  const calib::SurfacePose surface =
      calib::locateSurface(calib::loadPicture(options.photograph), layout, camera);
  calib::requireVisible(layout, camera, surface.T_camera_surface);
  const calib::Picture picture = calib::drawThrow(
      layout, estimate.projector, estimate.T_camera_projector.inverse() * surface.T_camera_surface);
  calib::savePicture(options.out, picture);
  std::cout << options.out << ": " << layout.targets.size()
            << " tags to throw; the surface is known from " << surface.tags.size()
            << " printed tags, which fit to " << fmt::format("{:.2f}", surface.rms_px)
            << " px\nShow it full screen, photograph it, then: afterglow calibrate verify --thrown "
               "PHOTOGRAPH --targets "
            << options.targets << " --calibration " << options.calibration
            << (options.camera.empty() ? "" : " --camera " + options.camera) << " --photograph "
            << options.photograph << "\n";
}

void runThrown(const CalibrateVerifyOptions& options) {
  const calib::TagLayout layout = loadTargets(options.targets);
  const calib::Lens camera = cameraFor(options);
  const calib::Picture thrown = calib::loadPicture(options.thrown);
  std::optional<calib::Picture> plain;
  if (!options.photograph.empty()) plain = calib::loadPicture(options.photograph);
  const calib::ThrowCheck check = calib::checkThrow(thrown, plain, layout, camera);
  if (!options.out.empty()) calib::saveErrorPicture(options.out, thrown, check);
  std::cout << (options.json ? dumpJson(verifyJson(check), 2) + "\n" : verifyText(check));
  const calib::ErrorSummary summary = calib::summarize(check.errors());
  if (summary.corners == 0) {
    throw std::runtime_error("none of the " + std::to_string(layout.targets.size()) +
                             " targets is seen in " + options.thrown +
                             "; is the planned picture shown, full screen and sharp?");
  }
  requireGood(summary, options);
  // Thrown too far away to be recognized is not good either.
  const auto missing = std::count_if(check.targets.begin(), check.targets.end(),
                                     [](const auto& target) { return !target.is_seen; });
  if (options.max_p95_mm && missing > 0) {
    throw std::runtime_error(std::to_string(missing) + " of the " +
                             std::to_string(layout.targets.size()) + " targets not seen in " +
                             options.thrown);
  }
}

// ---------------------------------------------------------------------------------------- options

void require(const std::string& value, const std::string& option, const std::string& mode) {
  if (value.empty()) throw CLI::RequiredError(option + " (with " + mode + ")");
}
void refuse(bool is_given, const std::string& option, const std::string& mode) {
  if (is_given) throw CLI::ExcludesError(option, mode);
}

void runVerify(const CalibrateVerifyOptions& options) {
  if ((options.images.empty() ? 0 : 1) + (options.is_plan ? 1 : 0) +
          (options.thrown.empty() ? 0 : 1) !=
      1) {
    throw CLI::ValidationError("verify", "give one of --images, --plan and --thrown");
  }
  if (!options.images.empty()) {
    require(options.board, "--board", "--images");
    require(options.pattern, "--pattern", "--images");
    require(options.calibration, "--calibration", "--images");
    refuse(!options.targets.empty(), "--targets", "--images");
    refuse(!options.photograph.empty(), "--photograph", "--images");
    refuse(!options.out.empty(), "--out", "--images");
    return runViews(options);
  }
  const std::string mode = options.is_plan ? "--plan" : "--thrown";
  require(options.targets, "--targets", mode);
  refuse(!options.board.empty(), "--board", mode);
  refuse(!options.pattern.empty(), "--pattern", mode);
  if (!options.is_plan) {
    if (options.camera.empty()) require(options.calibration, "--calibration or --camera", mode);
    return runThrown(options);
  }
  require(options.photograph, "--photograph", mode);
  require(options.calibration, "--calibration", mode);
  require(options.out, "--out", mode);
  refuse(options.max_p95_mm.has_value(), "--max-p95-mm", mode);
  refuse(options.json, "--json", mode);
  runPlan(options);
}

void addViewOptions(CLI::App& verb, CalibrateVerifyOptions& options) {
  verb.add_option("--images", options.images,
                  "Measure on the board: folder of fresh view_NN.png (pattern shown) and "
                  "view_NN_plain.png (plain gray shown)");
  verb.add_option("--board", options.board, "With --images: the board's board.yaml");
  verb.add_option("--pattern", options.pattern, "With --images: the pattern's pattern.yaml");
}

void addThrowOptions(CLI::App& verb, CalibrateVerifyOptions& options) {
  verb.add_flag("--plan", options.is_plan,
                "Draw the projector's picture that throws the targets on their places");
  verb.add_option("--thrown", options.thrown,
                  "Measure on a floor or table: the photograph with the planned picture thrown");
  verb.add_option("--targets", options.targets,
                  "With --plan or --thrown: YAML of printed tags with known places (tags) and of "
                  "tags to throw (targets), meters on the surface");
  verb.add_option("--photograph", options.photograph,
                  "The surface from the same place without the picture thrown: --plan needs it, "
                  "--thrown is better with it");
  verb.add_option("--out", options.out,
                  "With --plan: the picture to project; with --thrown: the photograph with the "
                  "errors drawn, ten times as long (PNG)");
}

}  // namespace

void addCalibrateVerify(CLI::App& calibrate) {
  auto options = std::make_shared<CalibrateVerifyOptions>();
  CLI::App* verb = calibrate.add_subcommand(
      "verify", "Check a calibration with photographs it has not seen, in millimeters");
  addViewOptions(*verb, *options);
  addThrowOptions(*verb, *options);
  verb->add_option(
      "--camera", options->camera,
      "The camera's camera_info file; without it, and with the one the calibration was "
      "made with, the calibration's own camera.yaml");
  verb->add_option("--calibration", options->calibration,
                   "Folder of the calibration (projector.yaml, T_camera_projector.yaml)");
  verb->add_option("--max-p95-mm", options->max_p95_mm,
                   "Fail (exit 1) if the 95th percentile of the errors is larger")
      ->check(CLI::PositiveNumber);
  verb->add_flag("--json", options->json, "As JSON");
  verb->callback([options] { runVerify(*options); });
}

}  // namespace afterglow::nodes
