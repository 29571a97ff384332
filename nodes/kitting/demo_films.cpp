#include "nodes/kitting/demo_films.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "nodes/tools/program.hpp"

namespace afterglow::nodes {
namespace {

constexpr const char *kPart_s = "20",
                     *kShortFilm_s = "14.5";     // of the long film, and each short one
constexpr const char* kPictureSize = "638,648";  // as in the films

std::string afterglowCommand() {
  return std::filesystem::canonical("/proc/self/exe").parent_path() / "afterglow";
}

/// Makes the folder, with one for key frames, and returns its name.
std::string withFrames(const std::string& folder) {
  std::filesystem::create_directories(folder + "/frames");
  return folder;
}

void runAll(const std::vector<std::vector<std::string>>& commands) {
  for (const std::vector<std::string>& command : commands) {
    const ProgramResult result = runProgram(command);
    const bool is_mute = result.output.find("not heard") != std::string::npos;
    if (result.status == 0 && !is_mute) continue;
    throw std::runtime_error(fmt::format("'{}' failed: {}", fmt::join(command, " "),
                                         result.output.substr(0, result.output.find('\n'))));
  }
}

}  // namespace

DemoFilms::DemoFilms(const DemoFolders& folders)
    : folders_(folders), work_(withFrames(folders.out) + "/demo.mp4") {}

void DemoFilms::run(std::vector<Command> commands) {
  for (Command& command : commands) command.insert(command.begin(), {"nice", "-n", "19"});
  running_.push_back(std::async(std::launch::async, runAll, std::move(commands)));
}

DemoFilms::Command DemoFilms::keyFrames(const MeasuredBehavior& measured, bool is_replay,
                                        bool is_observed) const {
  Command command = {afterglowCommand(),
                     "render",
                     std::to_string(is_replay ? measured.replay_id : measured.behavior.id),
                     "--store",
                     folders_.out + "/demo.db",
                     "--config",
                     folders_.assets + "/projector.yaml"};
  if (is_observed) {
    command.insert(command.end(), {"--view", "observer", "--room", folders_.assets + "/view.yaml",
                                   "--place", measured.behavior.name, "--size", kPictureSize});
  }
  for (const KeyFrame& frame : measured.key_frames) {
    const double at_s = is_replay ? frame.replay_offset_s : frame.offset_s;
    const std::string& name = is_replay ? frame.replay : frame.live;
    command.insert(command.end(), {"--at", fmt::format("{:.3f}", at_s), "--out",
                                   fmt::format("{}/frames/{}{}.png", folders_.out, name,
                                               is_observed ? "" : "_projector")});
  }
  return command;
}

void DemoFilms::begin(const MeasuredBehavior& measured, const BehaviorStory& story) {
  parts_.push_back(work_.path(measured.behavior.name + ".mp4"));
  Command film = {afterglowCommand()};
  const Command words = filmArguments(measured, folders_.assets);
  film.insert(film.end(), words.begin(), words.end());
  film.insert(film.end(),
              {"--store", folders_.out + "/demo.db", "--fps", "15", "--caption", story.caption,
               "--at-most", kPart_s, "--out", parts_.back(), "--at-most", kShortFilm_s, "--out",
               folders_.out + "/" + measured.behavior.name + ".mp4"});
  run({film});
  run({keyFrames(measured, false, true), keyFrames(measured, true, true),
       keyFrames(measured, false, false), keyFrames(measured, true, false)});
}

void DemoFilms::finish(const std::string& video) {
  for (std::future<void>& each : running_) each.get();
  running_.clear();
  const std::string list = work_.path("parts.txt");
  std::ofstream file(list);
  for (const std::string& part : parts_) file << "file 'file:" << part << "'\n";
  file.close();
  runAll({{"ffmpeg", "-hide_banner", "-nostats", "-nostdin", "-loglevel", "error", "-y", "-f",
           "concat", "-safe", "0", "-i", list, "-c", "copy", "-movflags", "+faststart",
           "file:" + video}});
}

}  // namespace afterglow::nodes
