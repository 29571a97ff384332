#include "nodes/verbs/command.hpp"

#include <CLI/Validators.hpp>
#include <iostream>
#include <memory>

#include "calib/targets/pattern.hpp"
#include "calib/targets/tag.hpp"
#include "calib/targets/target_files.hpp"

namespace afterglow::nodes {
namespace {

struct CalibratePatternOptions {
  std::string out;
  int width = 0, height = 0;
  std::string family = "tag36h11";
  bool single = false;
};

void runPattern(const CalibratePatternOptions& options) {
  const calib::Pattern pattern =
      calib::makePattern(options.width, options.height, options.family,
                         options.single ? calib::PatternUse::Singles : calib::PatternUse::Pairs);
  calib::writePattern(options.out, pattern);
  std::cout << "pattern.png and pattern.yaml in " << options.out << ": " << pattern.tags.size()
            << " tags (" << pattern.family << ", ids " << pattern.tags.front().id << " to "
            << pattern.tags.back().id << ") on " << pattern.width << " x " << pattern.height
            << " pixels\n"
            << "Show pattern.png full screen, one pixel of it a pixel of the projector, with "
               "keystone correction and digital zoom off.\n";
}

}  // namespace

void addCalibratePattern(CLI::App& calibrate) {
  auto options = std::make_shared<CalibratePatternOptions>();
  CLI::App* verb = calibrate.add_subcommand(
      "pattern", "Write the picture of tags to project: pattern.png, pattern.yaml");
  verb->add_option("--width", options->width, "The projector's own resolution, pixels")->required();
  verb->add_option("--height", options->height, "The projector's own resolution, pixels")
      ->required();
  verb->add_option("--out", options->out, "Folder for the files; made if it is not there")
      ->required();
  verb->add_option("--family", options->family, "The tags' family")
      ->check(CLI::IsMember(calib::kTagFamilies))
      ->capture_default_str();
  verb->add_flag("--single", options->single,
                 "For photographs without a plain one beside each: fewer tags, between which the "
                 "board's printed tags are read");
  verb->callback([options] { runPattern(*options); });
}

}  // namespace afterglow::nodes
