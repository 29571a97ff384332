#include "nodes/projector/output_config.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "calib/color/color.hpp"
#include "nodes/projector/layer_config.hpp"

namespace afterglow::nodes {
namespace {

const std::vector<std::string> kKeys = {"camera_info", "frame", "latency_ms",     "drawing",
                                        "monitor",     "gamma", "max_brightness", "mirror",
                                        "color"};
// In the order of the enum it names.
const std::vector<std::string> kDrawings = {"auto", "opengl", "cpu"};

constexpr double kGreatestLatency = 500;  // ms; beyond it extrapolation is a guess
constexpr double kLeastGamma = 1, kGreatestGamma = 4;

/// Reads one number for all channels, or three.
std::array<double, 3> readGamma(const YamlMap& map) {
  const YAML::Node node = map.at("gamma");
  if (!node.IsSequence()) {
    const double gamma = map.number("gamma", kLeastGamma, kGreatestGamma);
    return {gamma, gamma, gamma};
  }
  const auto rgb = map.numbers(node, "'gamma' of " + map.where(), 3);
  for (const double gamma : rgb) {
    if (gamma < kLeastGamma || gamma > kGreatestGamma) map.fail(node, "a gamma goes from 1 to 4");
  }
  return {rgb[0], rgb[1], rgb[2]};
}

/// Relative to the folder, as the lens's file is.
std::vector<std::uint8_t> readColors(const YamlMap& map, const std::string& folder,
                                     const render::LightSettings& light) {
  if (light.gamma) map.fail(map.at("color"), "either 'gamma' or 'color', which measures it, too");
  const auto path = std::filesystem::path(folder) / map.text("color");
  try {
    return calib::colorTable(calib::loadColor(path.string()), light.max_brightness);
  } catch (const std::runtime_error& error) {
    map.fail(map.at("color"), error.what());
  }
}

OutputConfig readOutput(const YamlMap& map, const std::string& folder) {
  OutputConfig output;
  output.camera_info = (std::filesystem::path(folder) / map.text("camera_info")).string();
  output.frame = readFrame(map, "frame");
  output.latency_ns = std::llround(map.number("latency_ms", 0, kGreatestLatency, 0) * 1e6);
  if (map.has("drawing")) {
    output.drawing = static_cast<render::Drawing>(map.choice("drawing", kDrawings));
  }
  if (map.has("monitor")) output.monitor = map.text("monitor");
  if (map.has("gamma")) output.light.gamma = readGamma(map);
  output.light.max_brightness = map.number("max_brightness", 0, 1, 1);
  if (map.has("color")) output.light.colors = readColors(map, folder, output.light);
  if (map.has("mirror")) {
    output.light.mirror = static_cast<render::Mirror>(map.choice("mirror", render::kMirrorNames));
  }
  return output;
}

/// The name is part of topics.
bool isTopicName(const std::string& name) {
  const auto isWordCharacter = [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; };
  return !name.empty() && std::isalpha(static_cast<unsigned char>(name.front())) != 0 &&
         std::all_of(name.begin(), name.end(), isWordCharacter);
}

}  // namespace

calib::CameraInfoFile loadLens(const OutputConfig& output) {
  calib::CameraInfoFile file = calib::loadCameraInfo(output.camera_info);
  const std::int64_t width = file.lens.width, height = file.lens.height;
  if (width * height > kMostPixels) {
    throw std::runtime_error(fmt::format("{}: a picture of {} x {} pixels: a projector's has at "
                                         "most {} million",
                                         output.camera_info, width, height,
                                         kMostPixels / 1'000'000));
  }
  return file;
}

std::vector<OutputConfig> readOutputs(const YamlMap& root, const std::string& folder) {
  if (!root.has("projectors")) {
    return {readOutput(root.map(root.at("projector"), "'projector'", kKeys), folder)};
  }
  const YAML::Node projectors = root.at("projectors");
  if (root.has("projector")) root.fail(projectors, "either 'projector' or 'projectors', not both");
  if (!projectors.IsMap() || projectors.size() == 0) {
    root.fail(projectors, "'projectors' should map names to at least one projector");
  }
  std::vector<OutputConfig> outputs;
  for (const auto& entry : projectors) {
    const std::string name = entry.first.Scalar();
    if (!isTopicName(name)) {
      root.fail(entry.first, "projector '" + name +
                                 "': a name has letters, digits and '_', and begins with a letter");
    }
    const auto isSame = [&](const auto& other) { return other.name == name; };
    if (std::any_of(outputs.begin(), outputs.end(), isSame)) {
      root.fail(entry.first, "projector '" + name + "' twice");
    }
    OutputConfig output =
        readOutput(root.map(entry.second, "projector '" + name + "'", kKeys), folder);
    output.name = name;
    const auto isThere = [&](const auto& other) { return other.monitor == output.monitor; };
    if (!output.monitor.empty() && std::any_of(outputs.begin(), outputs.end(), isThere)) {
      root.fail(entry.first, "monitor '" + output.monitor + "' twice");
    }
    outputs.push_back(std::move(output));
  }
  return outputs;
}

}  // namespace afterglow::nodes
