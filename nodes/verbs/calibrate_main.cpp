// `afterglow calibrate`: boards, patterns, and what is solved with them.
#include "nodes/verbs/command.hpp"

#include <CLI/Validators.hpp>
#include <algorithm>
#include <cmath>
#include <iostream>
#include <memory>

#include "calib/targets/board.hpp"
#include "calib/targets/pattern.hpp"
#include "calib/targets/tag.hpp"
#include "calib/targets/target_files.hpp"

namespace afterglow::nodes {
namespace {

struct CalibrateBoardOptions {
  std::string out;
  std::pair<double, double> size_m{0, 0};
  std::string paper = "A2";
  std::string family = "tag36h11";
};

/// Whole tenths, as rulers have them.
double millimeters(double meters) { return std::round(meters * 1e4) / 10; }

Eigen::Vector2d sizeOf(const CalibrateBoardOptions& options, bool has_size) {
  if (has_size) return {options.size_m.first, options.size_m.second};
  const auto paper = std::find_if(calib::kPapers.begin(), calib::kPapers.end(),
                                  [&](const auto& one) { return one.name == options.paper; });
  return paper->size_m;
}

void runBoard(const CalibrateBoardOptions& options, bool has_size) {
  const calib::Board board = calib::makeBoard(sizeOf(options, has_size), options.family);
  calib::writeBoard(options.out, board);
  const calib::Tag& tag = board.tags.front();
  std::cout << "board.pdf, board.png and board.yaml in " << options.out << ": " << board.tags.size()
            << " tags (" << board.family << ", ids " << tag.id << " to " << board.tags.back().id
            << ") of " << millimeters((tag.corners[1] - tag.corners[0]).norm())
            << " mm on a sheet of " << millimeters(board.size_m.x()) << " x "
            << millimeters(board.size_m.y()) << " mm\n"
            << "Print board.pdf at 100 % (not \"fit to page\") and measure its ruler: "
            << millimeters(board.ruler_m) << " mm. Then glue it onto something flat and stiff.\n";
}

}  // namespace

void addCalibrateBoard(CLI::App& calibrate) {
  auto options = std::make_shared<CalibrateBoardOptions>();
  CLI::App* verb = calibrate.add_subcommand(
      "board", "Write a board of tags to print: board.pdf (true size), board.png, board.yaml");
  verb->add_option("--out", options->out, "Folder for the files; made if it is not there")
      ->required();
  CLI::Option* size =
      verb->add_option("--size", options->size_m, "The sheet, W,H in meters, instead of --paper")
          ->delimiter(',')
          ->type_name("W,H");
  std::vector<std::string> papers;
  for (const calib::Paper& paper : calib::kPapers) papers.emplace_back(paper.name);
  verb->add_option("--paper", options->paper,
                   "The sheet, landscape: A4, A3, A2, A1, A0, Letter or Tabloid")
      ->transform(CLI::IsMember(papers, CLI::ignore_case))
      ->capture_default_str()
      ->excludes(size);
  verb->add_option("--family", options->family, "The tags' family")
      ->check(CLI::IsMember(calib::kTagFamilies))
      ->capture_default_str();
  verb->callback([options, size] { runBoard(*options, !size->empty()); });
}

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

void addCalibrateVerb(CLI::App& app) {
  CLI::App* calibrate = addVerb(app, "calibrate");
  calibrate->require_subcommand(1);
  addCalibrateBoard(*calibrate);
  addCalibratePattern(*calibrate);
  addCalibrateSolve(*calibrate);
  addCalibrateMount(*calibrate);
  addCalibrateVerify(*calibrate);
  addCalibrateColor(*calibrate);
  addCalibrateTexture(*calibrate);
  addCalibrateLatency(*calibrate);
}

}  // namespace afterglow::nodes

int main(int argc, char** argv) {
  return afterglow::nodes::runCommand(argc, argv, {afterglow::nodes::addCalibrateVerb});
}
