/// \file
/// A projector: its lens, where it is, what light it gives and which screen is its own.
/// `projector`, or an entry of `projectors`, in the configuration; assets/projector.yaml explains
/// every key.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "calib/camera_info_file.hpp"
#include "nodes/tools/yaml_map.hpp"
#include "render/light_blend.hpp"
#include "render/light_output.hpp"
#include "render/projector_renderer.hpp"

namespace afterglow::nodes {

struct OutputConfig {
  std::string name;         ///< among several projectors; empty: it is the only one
  std::string camera_info;  ///< path of the lens's file
  std::string frame;        ///< the projector's optical frame
  /// Time from a drawn picture to its light, ns: a moving projector is drawn for where it will be
  /// then.
  std::int64_t latency_ns = 0;
  /// The time from the beginning of a picture that takes so long to draw to its light; 0 without a
  /// latency: then it is drawn for its beginning.
  std::int64_t aheadNs(std::int64_t drawing_ns) const {
    return latency_ns > 0 ? drawing_ns + latency_ns : 0;
  }
  render::Drawing drawing = render::Drawing::Measured;
  std::string monitor;  ///< connector, model or index; empty: not configured
  render::LightSettings light;
  // For blending:
  double lumens = 0;       ///< luminous flux of its full light; 0: not configured
  double contrast = 0;     ///< full light by black's; 0: not configured
  double color_white = 1;  ///< share of its full light that its colors' white needs

  render::BlendedProjector blended(const calib::Lens& lens) const {
    const double white = color_white * light.max_brightness;
    return {lens, lumens, white, contrast > 0 ? 1 / contrast : 0};
  }
};

/// The projectors' shares of the light where several light the same place.
struct BlendConfig {
  bool evens_black = false;
};

/// A projector's picture has at most so many pixels: 8K UHD has 33.2 million. Each takes about ten
/// bytes while it is drawn.
constexpr std::int64_t kMostPixels = std::int64_t{1} << 25;

/// The lens of the projector's file. Throws std::runtime_error naming the file, as loadCameraInfo,
/// and for more pixels than kMostPixels.
calib::CameraInfoFile loadLens(const OutputConfig& output);

/// The projectors of a whole configuration, at least one: `projector` or `projectors`.
/// `camera_info`, `color` and `textures` are relative to `folder`. Throws std::runtime_error
/// "FILE:LINE: what is wrong".
std::vector<OutputConfig> readOutputs(const YamlMap& root, const std::string& folder);

/// `blend` of a whole configuration; empty: no. Throws as readOutputs does: it lacks what it needs.
std::optional<BlendConfig> readBlend(const YamlMap& root, const std::vector<OutputConfig>& outputs);

/// Writes a projector's latency_ms, to a tenth of a ms, into its configuration, which stays as it
/// is otherwise. `name`: which one, among several; may be empty where there is one. Throws
/// std::runtime_error: a file or value that readOutputs would refuse, no projector of this name.
void writeLatency(const std::string& config, const std::string& name, double ms);

}  // namespace afterglow::nodes
