#include "nodes/verbs/command.hpp"

#include <fmt/format.h>

#include <CLI/Error.hpp>
#include <CLI/Option.hpp>
#include <CLI/Validators.hpp>
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>

#include "calib/camera_info_file.hpp"
#include "calib/color/texture_photographs.hpp"
#include "calib/report/calibration_files.hpp"
#include "calib/verify/throw_picture.hpp"
#include "nodes/projector/projector_config.hpp"
#include "nodes/tools/mount_poses.hpp"
#include "nodes/tools/tag_layout_file.hpp"
#include "nodes/verbs/verb_node.hpp"
#include "nodes/verbs/verb_tools.hpp"

namespace afterglow::nodes {
namespace {

struct CalibrateTextureOptions {
  std::string config, calibration, projector, surface;
  std::string images, flat;
  std::string tags, photograph;   // the surface by printed tags,
  std::vector<double> camera_tf;  // by numbers,
  bool from_tf = false;           // or by the running robot
  std::string camera, camera_frame, out;
  double cell_mm = 0;
  bool json = false;
};

constexpr double kTfPatience_s = 5;

const SurfaceConfig& surfaceOf(const ProjectorConfig& config,
                               const CalibrateTextureOptions& options) {
  const auto found =
      std::find_if(config.surfaces.begin(), config.surfaces.end(),
                   [&](const SurfaceConfig& known) { return known.name == options.surface; });
  if (found == config.surfaces.end()) {
    throw std::runtime_error(options.config + ": has no surface '" + options.surface + "'");
  }
  if (found->isMeasured()) {
    throw std::runtime_error("surface '" + options.surface +
                             "' is found, or has a relief: a texture needs a plane whose frame "
                             "stays");
  }
  return *found;
}

calib::Lens cameraOf(const CalibrateTextureOptions& options) {
  std::optional<calib::Lens> given;
  if (!options.camera.empty()) given = calib::loadCameraInfo(options.camera).lens;
  return calib::cameraOf(options.calibration, given);
}

/// The places of both lenses while the colors were photographed.
void placeLenses(const CalibrateTextureOptions& options, const SurfaceConfig& surface,
                 const OutputConfig& projector, calib::TextureView& view) {
  if (options.from_tf) {
    const std::string camera =
        options.camera_frame.empty() ? cameraFrameOf(options.calibration) : options.camera_frame;
    const auto transforms =
        askTransforms({{camera, surface.frame}, {projector.frame, surface.frame}}, kTfPatience_s);
    view.T_camera_surface = Rigid<Camera, Surface>(transforms[0]);
    view.T_projector_surface = Rigid<Projector, Surface>(transforms[1]);
    return;
  }
  if (!options.tags.empty()) {
    view.T_camera_surface = calib::locateSurface(calib::loadPicture(options.photograph),
                                                 loadTagLayout(options.tags), view.camera)
                                .T_camera_surface;
  } else {
    view.T_camera_surface =
        Rigid<Surface, Camera>(poseFromNumbers(options.camera_tf, "--camera-tf")).inverse();
  }
  const auto T_camera_projector = calib::loadTCameraProjector(
      (std::filesystem::path(options.calibration) / "T_camera_projector.yaml").string());
  view.T_projector_surface = T_camera_projector.inverse() * view.T_camera_surface;
}

nlohmann::ordered_json textureJson(const calib::TextureFit& fit, const std::string& path) {
  return {{"file", path},
          {"surface", fit.texture.surface},
          {"cell_mm", 1000 * fit.texture.cell},
          {"columns", fit.texture.columns},
          {"rows", fit.texture.rows},
          {"share_known", fit.known_share},
          {"white", fit.white},
          {"white_of_most", fit.white / fit.median_gray},
          {"share_reached", fit.share_reached},
          {"checks", fit.checks},
          {"check_median", fit.check_median},
          {"check_p95", fit.check_p95}};
}

void printTexture(const calib::TextureFit& fit, const std::string& path) {
  std::cout << fmt::format(
      "{}: cells of {:.1f} mm, {:.0f} % of those in the light are known.\n"
      "From here white is dimmed to {:.0f} % of what half of the surface could show, to be even;\n"
      "{:.0f} % of sRGB's colors are then within reach all over it. {}\n"
      "Differences are CIEDE2000; the camera's RGB is taken for sRGB.\n"
      "Add to the projector's configuration: textures: [{}]\n",
      path, 1000 * fit.texture.cell, 100 * fit.known_share, 100 * fit.white / fit.median_gray,
      100 * fit.share_reached,
      calib::checksText(fit.checks, fit.check_median, "95 %", fit.check_p95),
      std::filesystem::path(path).filename().string());
}

void runTexture(const CalibrateTextureOptions& options) {
  const ProjectorConfig config = loadProjectorConfig(options.config, options.calibration);
  const OutputConfig& projector = projectorNamed(config, options.config, options.projector);
  const SurfaceConfig& surface = surfaceOf(config, options);
  calib::TextureView view{cameraOf(options), loadLens(projector).lens, {}, {}};
  placeLenses(options, surface, projector, view);
  std::optional<Waiting> waiting(std::in_place, "reading the photographs");
  const calib::TextureFit fit = calib::fitTexture(
      options.images, view, {surface.name, surface.polygon, options.cell_mm / 1000, options.flat});
  waiting.reset();
  const std::string path = calib::saveTexture(options.out, fit.texture);
  if (options.json) {
    std::cout << dumpJson(textureJson(fit, path), 2) << "\n";
  } else {
    printTexture(fit, path);
  }
}

/// Checks what CLI11's needs and excludes cannot say.
void checkUsage(const CalibrateTextureOptions& options) {
  const int ways = (options.tags.empty() ? 0 : 1) + (options.camera_tf.empty() ? 0 : 1) +
                   (options.from_tf ? 1 : 0);
  if (ways != 1) {
    throw CLI::ValidationError("texture", "give one of --tags, --camera-tf and --from-tf");
  }
}

void addPlaces(CLI::App& verb, CalibrateTextureOptions& options) {
  CLI::Option* const photograph =
      verb.add_option("--photograph", options.photograph,
                      "With --tags: the surface with the tags, from the same place");
  CLI::Option* const tags = verb.add_option(
      "--tags", options.tags,
      "Where the camera was: YAML of printed tags with known places on the surface, as "
      "calibrate verify takes them; put them away before the colors are photographed");
  tags->needs(photograph);
  photograph->needs(tags);
  verb.add_option("--camera-tf", options.camera_tf,
                  "The same, the camera's optical frame in the surface's: x,y,z,qx,qy,qz,qw")
      ->delimiter(',')
      ->expected(7);
  CLI::Option* const from_tf = verb.add_flag(
      "--from-tf", options.from_tf,
      "The same, of camera and projector: ask the running robot, which still stands there");
  verb.add_option("--camera-frame", options.camera_frame,
                  "With --from-tf: the camera's optical frame; default: what the calibration says")
      ->needs(from_tf);
}

}  // namespace

void addCalibrateTexture(CLI::App& calibrate) {
  auto options = std::make_shared<CalibrateTextureOptions>();
  CLI::App* verb = calibrate.add_subcommand(
      "texture",
      "The same, place by place, of a surface that is not even: from color's photographs");
  verb->add_option("--config", options->config, "The configuration that has the surface")
      ->required();
  verb->add_option("--surface", options->surface, "Which of its surfaces")->required();
  verb->add_option("--projector", options->projector,
                   "Which one, where the configuration has several");
  verb->add_option("--calibration", options->calibration,
                   "Folder of the calibration of camera and projector")
      ->required();
  verb->add_option("--images", options->images,
                   "Folder of the photographs, each named as its picture by calibrate color "
                   "--pictures")
      ->required();
  verb->add_option(
      "--flat", options->flat,
      "A photograph, by the same lens and aperture, of something plain and evenly lit: "
      "how the lens darkens the corners");
  addPlaces(*verb, *options);
  verb->add_option("--camera", options->camera,
                   "The camera's camera_info file; default: the calibration's camera.yaml");
  verb->add_option("--cell-mm", options->cell_mm,
                   "Side of a cell; default: one and a half of the projector's pixels")
      ->check(CLI::Range(0.1, 1000.0));
  verb->add_option("--out", options->out,
                   "Folder for SURFACE_texture.yaml and its picture: that of the calibration")
      ->required();
  verb->add_flag("--json", options->json, "What was found, as JSON");
  verb->callback([options] {
    checkUsage(*options);
    runTexture(*options);
  });
}

}  // namespace afterglow::nodes
