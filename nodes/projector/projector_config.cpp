#include "nodes/projector/projector_config.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "nodes/tools/yaml_map.hpp"

namespace afterglow::nodes {
namespace {

// In the order of the enum it names.
const std::vector<std::string> kDrawings = {"auto", "opengl", "cpu"};
constexpr double kGreatestLatency = 500;  // ms; beyond it extrapolation is a guess

/// Reads one file into one ProjectorConfig.
class ConfigReader {
 public:
  ConfigReader(std::string file, std::string calibration_folder)
      : file_(std::move(file)), calibration_folder_(std::move(calibration_folder)) {}

  ProjectorConfig read() {
    const YamlMap root(file_, loadYaml(file_), "the configuration",
                       {"fixed_frame", "projector", "surfaces", "layers", "mesh_roots", "watch"});
    config_.fixed_frame = root.text("fixed_frame");
    readProjector(map(root.at("projector"), "'projector'",
                      {"camera_info", "frame", "latency_ms", "drawing"}));
    if (root.has("surfaces")) readSurfaces(root);
    readLayers(root);
    if (root.has("mesh_roots")) readMeshRoots(root);
    if (root.has("watch")) {
      config_.watch = readWatchConfig(map(root.at("watch"), "'watch'", kWatchKeys),
                                      std::filesystem::path(file_).parent_path().string());
    }
    return std::move(config_);
  }

 private:
  YamlMap map(const YAML::Node& node, const std::string& where,
              const std::vector<std::string>& keys) const {
    return {file_, node, where, keys};
  }

  void readProjector(const YamlMap& map) {
    const std::filesystem::path own_folder = std::filesystem::path(file_).parent_path();
    const std::filesystem::path folder =
        calibration_folder_.empty() ? own_folder : std::filesystem::path(calibration_folder_);
    config_.camera_info = (folder / map.text("camera_info")).string();
    config_.frame = map.text("frame");
    config_.latency_ns = std::llround(map.number("latency_ms", 0, kGreatestLatency, 0) * 1e6);
    if (map.has("drawing")) {
      config_.drawing = static_cast<render::Drawing>(map.choice("drawing", kDrawings));
    }
  }

  void readSurfaces(const YamlMap& root) {
    const YAML::Node surfaces = root.at("surfaces");
    if (!surfaces.IsMap()) root.fail(surfaces, "'surfaces' should map names to surfaces");
    for (const auto& entry : surfaces) {
      SurfaceConfig surface;
      surface.name = entry.first.Scalar();
      const YamlMap map =
          this->map(entry.second, "surface '" + surface.name + "'", {"frame", "polygon"});
      const auto same = [&surface](const auto& other) { return other.name == surface.name; };
      if (std::any_of(config_.surfaces.begin(), config_.surfaces.end(), same)) {
        root.fail(entry.first, "surface '" + surface.name + "' twice");
      }
      surface.frame = map.text("frame");
      if (map.has("polygon")) surface.polygon = readPolygon(map);
      config_.surfaces.push_back(std::move(surface));
    }
  }

  static std::vector<Eigen::Vector2d> readPolygon(const YamlMap& map) {
    const YAML::Node node = map.at("polygon");
    std::vector<Eigen::Vector2d> polygon;
    for (std::size_t i = 0; node.IsSequence() && i < node.size(); ++i) {
      const auto corner = map.numbers(node[i], "a corner of " + map.where(), 2);
      polygon.emplace_back(corner[0], corner[1]);
    }
    double area = 0;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Eigen::Vector2d& a = polygon[i];
      const Eigen::Vector2d& b = polygon[(i + 1) % polygon.size()];
      area += (a.x() * b.y() - a.y() * b.x()) / 2;
    }
    if (!(std::abs(area) > 0)) map.fail(node, "the polygon of " + map.where() + " has no area");
    return polygon;
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

}  // namespace afterglow::nodes
