#include "nodes/projector/output_config.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "calib/color/color.hpp"
#include "calib/color/texture.hpp"
#include "calib/file_replacement.hpp"
#include "nodes/projector/layer_config.hpp"

namespace afterglow::nodes {
namespace {

const std::vector<std::string> kKeys = {"camera_info", "frame",    "latency_ms",     "drawing",
                                        "monitor",     "gamma",    "max_brightness", "mirror",
                                        "color",       "textures", "lumens",         "contrast"};
// In the order of the enum it names.
const std::vector<std::string> kDrawings = {"auto", "opengl", "cpu"};

constexpr double kGreatestLatency = 500;  // ms; beyond it extrapolation is a guess
constexpr double kLeastGamma = 1, kGreatestGamma = 4;
constexpr double kMostLumens = 100'000, kLeastContrast = 10, kMostContrast = 1e7;

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
void readColors(const YamlMap& map, const std::string& folder, OutputConfig& output) {
  render::LightSettings& light = output.light;
  if (light.gamma) map.fail(map.at("color"), "either 'gamma' or 'color', which measures it, too");
  const auto path = std::filesystem::path(folder) / map.text("color");
  try {
    const calib::ColorResponse response = calib::loadColor(path.string());
    light.colors = calib::colorTable(response, light.max_brightness);
    output.color_white = response.whiteShare();
  } catch (const std::runtime_error& error) {
    map.fail(map.at("color"), error.what());
  }
}

/// Relative to the folder, too.
std::vector<calib::SurfaceTexture> readTextures(const YamlMap& map, const std::string& folder) {
  const YAML::Node files = map.at("textures");
  if (!files.IsSequence() || files.size() == 0) {
    map.fail(files, "'textures' should be a list of at least one file");
  }
  std::vector<calib::SurfaceTexture> textures;
  for (const YAML::Node& file : files) {
    if (!file.IsScalar()) map.fail(file, "'textures' should be a list of files");
    try {
      textures.push_back(
          calib::loadTexture((std::filesystem::path(folder) / file.Scalar()).string()));
    } catch (const std::runtime_error& error) {
      map.fail(file, error.what());
    }
    const auto isSame = [&](const auto& texture) {
      return texture.surface == textures.back().surface;
    };
    if (std::count_if(textures.begin(), textures.end(), isSame) > 1) {
      map.fail(file, "two textures of surface '" + textures.back().surface + "'");
    }
  }
  return textures;
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
  if (map.has("color")) readColors(map, folder, output);
  if (map.has("textures")) output.light.textures = readTextures(map, folder);
  if (map.has("lumens")) output.lumens = map.number("lumens", 1, kMostLumens);
  if (map.has("contrast")) output.contrast = map.number("contrast", kLeastContrast, kMostContrast);
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

bool isBlendWanted(const YamlMap& root) {
  return root.has("blend") && (root.at("blend").IsMap() || readFlag(root, "blend", false));
}

/// Refuses a key that some of the projectors lack.
void requireOfAll(const YamlMap& root, const std::vector<OutputConfig>& outputs, const char* key,
                  double OutputConfig::*value, const std::string& why) {
  for (const OutputConfig& output : outputs) {
    if (output.*value > 0) continue;
    root.fail(root.at("blend"),
              fmt::format("projector '{}' has no '{}': {}", output.name, key, why));
  }
}

/// Returns the map of the projector of this name.
YAML::Node findOutput(const std::string& file, const YAML::Node& root, const std::string& name) {
  const YAML::Node one = root["projector"], several = root["projectors"];
  if (one.IsDefined() && name.empty()) return one;
  if (several.IsMap() && name.empty() && several.size() == 1) return several.begin()->second;
  if (several.IsMap() && several[name].IsDefined()) return several[name];
  throw std::runtime_error(file + (name.empty() ? ": has several projectors: name one of them"
                                                : ": has no projector '" + name + "'"));
}

/// The place of a value in the text, by its line and column.
std::size_t placeOf(const YAML::Node& value) { return static_cast<std::size_t>(value.Mark().pos); }

}  // namespace

void writeLatency(const std::string& config, const std::string& name, double ms) {
  if (!(ms >= 0 && ms <= kGreatestLatency)) {
    throw std::runtime_error(fmt::format("{}: latency_ms goes from 0 to {:.0f}, not {:.1f}", config,
                                         kGreatestLatency, ms));
  }
  std::ifstream file = calib::openRegularFile(config);
  std::string text(std::istreambuf_iterator<char>(file), {});
  const YAML::Node output = findOutput(config, calib::loadYaml(config), name);
  const std::string number = fmt::format("{:.1f}", ms);
  const YAML::Node old = output["latency_ms"], frame = output["frame"];
  if (old.IsDefined()) {
    text.replace(placeOf(old), old.Scalar().size(), number);
  } else if (frame.IsDefined()) {
    // Before the key `frame`, in the same style and as far in.
    const std::size_t key = text.rfind("frame", placeOf(frame));
    const std::size_t line = text.rfind('\n', key) + 1;
    const bool is_flow = output.Style() == YAML::EmitterStyle::Flow;
    text.insert(key,
                "latency_ms: " + number + (is_flow ? ", " : "\n" + std::string(key - line, ' ')));
  }
  // Written only if it says what it should, whatever the file's style.
  const YAML::Node now = findOutput(config, YAML::Load(text), name)["latency_ms"];
  if (!now.IsDefined() || now.Scalar() != number) {
    throw std::runtime_error(config + ": write it there yourself: latency_ms: " + number);
  }
  calib::replaceFile(config, text);
}

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

std::optional<BlendConfig> readBlend(const YamlMap& root,
                                     const std::vector<OutputConfig>& outputs) {
  if (!isBlendWanted(root)) return std::nullopt;
  const YAML::Node node = root.at("blend");
  BlendConfig blend;
  if (node.IsMap()) {
    blend.evens_black = readFlag(root.map(node, "'blend'", {"black"}), "black", false);
  }
  if (outputs.size() < 2) root.fail(node, "'blend' is for several 'projectors'");
  if (outputs.size() > render::LightBlend::kMost) {
    root.fail(node, fmt::format("at most {} projectors can be blended", render::LightBlend::kMost));
  }
  if (!root.has("surfaces")) {
    root.fail(node, "'blend' needs 'surfaces': where the projectors' light meets");
  }
  const auto hasLumens = [](const OutputConfig& output) { return output.lumens > 0; };
  if (std::any_of(outputs.begin(), outputs.end(), hasLumens)) {
    requireOfAll(root, outputs, "lumens", &OutputConfig::lumens, "all of them have it, or none");
  }
  for (const OutputConfig& output : outputs) {
    if (output.light.textures.empty()) continue;
    root.fail(node, "shares of light are not reckoned on 'textures', which projector '" +
                        output.name + "' has");
  }
  if (!blend.evens_black) return blend;
  // Black is raised behind the mask of what is avoided.
  if (root.has("avoid")) root.fail(node, "evened black would light what 'avoid' keeps dark");
  requireOfAll(root, outputs, "contrast", &OutputConfig::contrast, "its black is not known");
  for (const OutputConfig& output : outputs) {
    if (output.light.colors.empty()) continue;
    root.fail(node, "black is evened by 'gamma' or sRGB's curve, and projector '" + output.name +
                        "' has 'color'");
  }
  return blend;
}

}  // namespace afterglow::nodes
