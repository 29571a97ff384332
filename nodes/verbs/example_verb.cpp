#include <fmt/format.h>
#include <ros/package.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <vector>

#include "nodes/tools/ros_graph.hpp"
#include "nodes/verbs/command.hpp"
#include "nodes/verbs/verb_node.hpp"
#include "nodes/verbs/verb_tools.hpp"
#include "replay/query/nearest.hpp"

namespace afterglow::nodes {
namespace {

namespace fs = std::filesystem;

/// What the simulated robot alone offers: a real one should not move by a name that was tried.
constexpr const char* kSimulation = "/fake_fetch/reset";
constexpr const char* kRecorder = "/recorder_node/start_recording";

/// The folder of the examples; throws std::runtime_error where ROS does not know the package.
fs::path examplesFolder() {
  const fs::path package = ros::package::getPath("afterglow");
  const fs::path folder = package / "assets" / "examples";
  // Without a package the folder may be that of the clone one stands in, and its scripts would find
  // no module.
  if (!package.empty() && fs::is_directory(folder)) return folder;
  throw std::runtime_error(
      "ROS does not find the examples: source build/devel/setup.sh, or the "
      "workspace's");
}

/// Returns their names: "drive", and those in C++ with their ending.
std::vector<std::string> exampleNames(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& file : fs::directory_iterator(folder)) {
    const fs::path name = file.path().filename(), ending = name.extension();
    if (ending == ".py") names.push_back(name.stem().string());
    if (ending == ".cpp") names.push_back(name.string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

fs::path sourceOf(const fs::path& folder, const std::string& name) {
  return folder / (fs::path(name).has_extension() ? name : name + ".py");
}

/// The first sentence of an example: the comment that it begins with.
std::string purposeOf(const fs::path& source) {
  std::ifstream file(source);
  std::string line;
  while (std::getline(file, line)) {
    const bool is_python = line.rfind("\"\"\"", 0) == 0;
    if (!is_python && line.rfind("///", 0) != 0) continue;
    const std::size_t end = line.find(is_python ? "\"\"\"" : "\n", 3);
    return line.substr(is_python ? 3 : 4, end == line.npos ? end : end - 3);
  }
  return "";
}

void listExamples(const fs::path& folder) {
  TextTable table({{"EXAMPLE", TextTable::Align::Left}, {"", TextTable::Align::Left}});
  for (const std::string& name : exampleNames(folder)) {
    table.add({name, purposeOf(sourceOf(folder, name))});
  }
  std::cout << table.text()
            << "\nafterglow example NAME runs one; their sources: " << folder.string() << "\n";
}

/// Throws std::runtime_error unless the simulated robot runs, and a recorder.
void requireRobot() {
  nameVerbNode("afterglow_example");
  const RosGraph graph = askMaster(deadlineIn(kMasterPatience));
  if (graph.services.count(kSimulation) == 0) {
    throw std::runtime_error(
        "no simulated robot runs, and examples move no other: roslaunch afterglow "
        "fake_fetch.launch");
  }
  if (graph.services.count(kRecorder) == 0) {
    throw std::runtime_error("nobody would record it: roslaunch afterglow recorder.launch");
  }
}

/// Goes on as the example: a script, or the program that was made of a source.
[[noreturn]] void become(const fs::path& source) {
  const fs::path programs = fs::read_symlink("/proc/self/exe").parent_path();
  const bool is_script = source.extension() == ".py";
  const fs::path program = is_script ? source : programs / ("example_" + source.stem().string());
  std::cout << "running " << source.string() << "; then: afterglow show last "
            << source.stem().string() << std::endl;
  ::execl(program.c_str(), program.c_str(), nullptr);
  throw std::runtime_error("cannot start " + program.string() + ": " + std::strerror(errno));
}

void runExample(const std::string& name) {
  const fs::path folder = examplesFolder();
  if (name.empty()) return listExamples(folder);
  const std::vector<std::string> names = exampleNames(folder);
  if (std::count(names.begin(), names.end(), name) == 0) {
    const std::string hint = replay::didYouMean(name, names);
    throw std::runtime_error(
        "there is no example '" + name + "'" +
        (hint.empty() ? fmt::format("; there are: {}", fmt::join(names, ", ")) : hint));
  }
  requireRobot();
  become(sourceOf(folder, name));
}

}  // namespace

void addExampleVerb(CLI::App& app) {
  auto name = std::make_shared<std::string>();
  CLI::App* verb = addVerb(app, "example");
  verb->add_option("name", *name,
                   "Which: drive, light, point, speak, wave, or one in C++ by its file; without "
                   "it, they are listed");
  verb->callback([name] { runExample(*name); });
}

}  // namespace afterglow::nodes
