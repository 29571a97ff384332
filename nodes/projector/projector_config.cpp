#include "nodes/projector/projector_config.hpp"

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "nodes/projector/layer_config.hpp"
#include "nodes/tools/yaml_map.hpp"

namespace afterglow::nodes {
namespace {

/// Reads one file into one ProjectorConfig.
class ConfigReader {
 public:
  ConfigReader(std::string file, std::string calibration_folder)
      : file_(std::move(file)), calibration_folder_(std::move(calibration_folder)) {}

  ProjectorConfig read() {
    const YamlMap root(file_, loadYaml(file_), "the configuration",
                       {"fixed_frame", "projector", "projectors", "blend", "surfaces", "layers",
                        "mesh_roots", "watch", "avoid", "base"});
    config_.fixed_frame = readFrame(root, "fixed_frame");
    const std::string own_folder = std::filesystem::path(file_).parent_path().string();
    config_.projectors =
        readOutputs(root, calibration_folder_.empty() ? own_folder : calibration_folder_);
    refuseItselfAsLens(root);
    config_.blend = readBlend(root, config_.projectors);
    if (root.has("surfaces")) config_.surfaces = readSurfaceConfigs(root);
    refuseTextures(root);
    readLayers(root);
    if (root.has("mesh_roots")) readMeshRoots(root);
    if (root.has("watch")) {
      config_.watch = readWatchConfig(map(root.at("watch"), "'watch'", kWatchKeys), own_folder);
    }
    if (root.has("avoid")) {
      config_.avoid =
          readAvoidConfig(map(root.at("avoid"), "'avoid'", kAvoidKeys), !config_.surfaces.empty());
    }
    if (root.has("base")) config_.base = readBaseConfig(map(root.at("base"), "'base'", kBaseKeys));
    return std::move(config_);
  }

 private:
  /// A configuration and the lens in a calibration's folder often share the name projector.yaml.
  void refuseItselfAsLens(const YamlMap& root) const {
    for (const OutputConfig& output : config_.projectors) {
      std::error_code none;
      if (!std::filesystem::equivalent(output.camera_info, file_, none)) continue;
      root.fail(root.at(root.has("projector") ? "projector" : "projectors"),
                "'camera_info' names this configuration itself: the lens is in the folder that "
                "\"afterglow calibrate\" wrote; name that folder (--calibration, argument "
                "'calibration')");
    }
  }

  /// A texture lies in its surface's frame, which has to stay, and on its plane.
  void refuseTextures(const YamlMap& root) const {
    const YAML::Node projectors = root.at(root.has("projector") ? "projector" : "projectors");
    for (const OutputConfig& output : config_.projectors) {
      for (const calib::SurfaceTexture& texture : output.light.textures) {
        const auto surface =
            std::find_if(config_.surfaces.begin(), config_.surfaces.end(),
                         [&](const SurfaceConfig& known) { return known.name == texture.surface; });
        if (surface == config_.surfaces.end()) {
          root.fail(projectors, "a texture is of surface '" + texture.surface +
                                    "', which 'surfaces' does not have");
        }
        if (surface->isMeasured()) {
          root.fail(projectors, "surface '" + texture.surface +
                                    "' has a texture: it can be neither found ('find_in') nor have "
                                    "a 'relief'");
        }
      }
    }
  }

  YamlMap map(const YAML::Node& node, const std::string& where,
              const std::vector<std::string>& keys) const {
    return {file_, node, where, keys};
  }

  void readLayers(const YamlMap& root) {
    const YAML::Node layers = root.at("layers");
    if (!layers.IsSequence() || layers.size() == 0) {
      root.fail(layers, "'layers' should be a list of at least one layer");
    }
    for (std::size_t i = 0; i < layers.size(); ++i) {
      readLayer(map(layers[i], "layer " + std::to_string(i + 1), kLayerKeys));
    }
  }

  void readLayer(const YamlMap& map) {
    LayerConfig layer = readLayerConfig(map, config_.surfaces);
    const auto same = [&layer](const auto& other) { return other.topic == layer.topic; };
    if (std::any_of(config_.layers.begin(), config_.layers.end(), same)) {
      map.fail(map.at("topic"), "topic '" + layer.topic + "' twice");
    }
    config_.layers.push_back(std::move(layer));
  }

  void readMeshRoots(const YamlMap& root) {
    const YAML::Node roots = root.at("mesh_roots");
    if (!roots.IsSequence() || roots.size() == 0) {
      root.fail(roots, "'mesh_roots' should be a list of at least one folder");
    }
    for (const YAML::Node& node : roots) {
      const std::filesystem::path own_folder = std::filesystem::path(file_).parent_path();
      const std::filesystem::path folder = own_folder / (node.IsScalar() ? node.Scalar() : "");
      std::error_code ignored;
      if (!node.IsScalar() || !std::filesystem::is_directory(folder, ignored)) {
        root.fail(node, "no such folder in 'mesh_roots': '" + folder.string() + "'");
      }
      config_.mesh_roots.push_back(folder.string());
    }
  }

  std::string file_;
  std::string calibration_folder_;
  ProjectorConfig config_;
};

}  // namespace

ProjectorConfig loadProjectorConfig(const std::string& path,
                                    const std::string& calibration_folder) {
  return ConfigReader(path, calibration_folder).read();
}

const OutputConfig& projectorNamed(const ProjectorConfig& config, const std::string& path,
                                   const std::string& name) {
  const auto& all = config.projectors;
  if (name.empty() && all.size() == 1) return all.front();
  const auto found = std::find_if(all.begin(), all.end(),
                                  [&](const OutputConfig& output) { return output.name == name; });
  if (found != all.end()) return *found;
  throw std::runtime_error(path + (name.empty() ? ": has several projectors: name one of them"
                                                : ": has no projector '" + name + "'"));
}

}  // namespace afterglow::nodes
