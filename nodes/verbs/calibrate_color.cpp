#include "nodes/verbs/command.hpp"

#include <fmt/format.h>

#include <CLI/Error.hpp>
#include <CLI/Option.hpp>
#include <CLI/Validators.hpp>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "calib/color/color_photographs.hpp"
#include "calib/file_replacement.hpp"
#include "nodes/verbs/verb_tools.hpp"

namespace afterglow::nodes {
namespace {

struct CalibrateColorOptions {
  std::string pictures;
  int width = 0, height = 0;
  std::string images;
  std::string out;
  bool json = false;
};

void writePictures(const CalibrateColorOptions& options) {
  const std::size_t count =
      calib::writeColorPictures(options.pictures, options.width, options.height);
  std::cout << count << " pictures in " << options.pictures
            << ", a color each.\n"
               "Show them full screen on the surface, photograph each in their order, the camera "
               "still, its exposure, gain and\nwhite balance fixed so that nothing is overexposed, "
               "and name each photograph as its picture.\n";
}

std::string sentText(const calib::SentColor& color) {
  const auto& [red, green, blue] = color.sent;
  return fmt::format("#{:02x}{:02x}{:02x}", red, green, blue);
}

nlohmann::ordered_json colorJson(const calib::ColorFit& fit) {
  nlohmann::ordered_json json = {{"gamma", fit.gamma},
                                 {"white", fit.response.white()},
                                 {"checks", fit.checks},
                                 {"check_median", fit.check_median},
                                 {"check_worst", fit.check_worst},
                                 {"share_reached", fit.share_reached},
                                 {"colors", nlohmann::ordered_json::array()}};
  for (const calib::ColorReach& reach : fit.named) {
    json["colors"].push_back(
        {{"name", reach.name}, {"sent", sentText(reach.color)}, {"off", reach.color.off}});
  }
  return json;
}

void printColors(const calib::ColorFit& fit, const CalibrateColorOptions& options) {
  using Align = TextTable::Align;
  TextTable table({{"COLOR", Align::Left}, {"SENT AS", Align::Left}, {"OFF BY", Align::Right}});
  for (const calib::ColorReach& reach : fit.named) {
    table.add({reach.name + (reach.color.off < calib::kReachedDifference ? "" : " (out of reach)"),
               sentText(reach.color), fmt::format("{:.1f}", reach.color.off)});
  }
  std::cout << table.text()
            << fmt::format(
                   "color.yaml in {}: on this surface {:.0f} % of sRGB's colors are within reach "
                   "(off by less than {:.0f}),\nwhite being the brightest gray that is. {}\n"
                   "Differences are CIEDE2000; the camera's RGB is taken for sRGB.\n",
                   options.out, 100 * fit.share_reached, calib::kReachedDifference,
                   calib::checksText(fit.checks, fit.check_median, "the worst", fit.check_worst));
}

void runColor(const CalibrateColorOptions& options) {
  if (!options.pictures.empty()) {
    writePictures(options);
    return;
  }
  std::optional<Waiting> waiting(std::in_place, "reading the photographs");
  const calib::ColorFit fit = calib::fitColor(calib::readColorPhotographs(options.images));
  waiting.reset();
  calib::replaceFile((std::filesystem::path(options.out) / "color.yaml").string(),
                     calib::colorYaml(fit));
  if (options.json) {
    std::cout << dumpJson(colorJson(fit), 2) << "\n";
  } else {
    printColors(fit, options);
  }
}

/// Checks what CLI11's needs and excludes cannot say.
void checkUsage(const CalibrateColorOptions& options) {
  if (options.pictures.empty() == options.images.empty()) {
    throw CLI::ValidationError("color", "give --pictures, and then, of what was photographed, "
                                        "--images");
  }
  if (!options.pictures.empty() && (options.width == 0 || options.height == 0)) {
    throw CLI::ValidationError("color", "--pictures needs --width and --height of the projector");
  }
  if (!options.images.empty() && options.out.empty()) {
    throw CLI::ValidationError("color", "--images needs --out, the folder of the calibration");
  }
}

}  // namespace

void addCalibrateColor(CLI::App& calibrate) {
  auto options = std::make_shared<CalibrateColorOptions>();
  CLI::App* verb = calibrate.add_subcommand(
      "color", "Measure how colors look on a surface: pictures to show, then their photographs");
  verb->add_option("--pictures", options->pictures, "Write the pictures to show into this folder");
  verb->add_option("--width", options->width, "The projector's own resolution, pixels")
      ->check(CLI::Range(1, 8192));
  verb->add_option("--height", options->height, "The projector's own resolution, pixels")
      ->check(CLI::Range(1, 8192));
  verb->add_option("--images", options->images,
                   "Folder of their photographs, each named as its picture");
  verb->add_option("--out", options->out, "Folder for color.yaml: that of the calibration");
  verb->add_flag("--json", options->json, "What was found, as JSON");
  verb->callback([options] {
    checkUsage(*options);
    runColor(*options);
  });
}

}  // namespace afterglow::nodes
