/// \file
/// The diagnostics of projector_node: in /diagnostics everything, once a second; in the log each
/// fault when it is new, and now and then while it goes on.
#pragma once

#include <diagnostic_msgs/DiagnosticArray.h>
#include <ros/ros.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "nodes/projector/layer_state.hpp"
#include "render/compose/light_census.hpp"
#include "render/texture_light.hpp"

namespace afterglow::nodes {

/// The state of one projector.
struct OutputState {
  std::string name;      ///< among several; empty: the only one
  std::string renderer;  ///< OpenGL version and device, and who draws
  /// Problems of the last image; those of the projector itself begin with "projector: ".
  std::vector<std::string> problems;
  /// Census of its last pictures, by layer: what its light reaches. Empty: unknown.
  std::vector<render::LayerCensus> census;
  std::optional<double> light_off_mm = std::nullopt;   ///< LightOffset::mm()
  std::optional<double> avoided_share = std::nullopt;  ///< ProjectorOutput::avoidedShare()
  std::string blending = {};  ///< how it shares light with others; empty: it does not
  std::vector<render::TextureReport> textures = {};  ///< reports of its last picture
};

/// The state of the node, of its projectors and of its layers.
struct ProjectorState {
  std::string name;     ///< name of the node
  double drawn_hz = 0;  ///< images in the last second
  double wanted_hz = 0;
  double drawing_ms = 0;   ///< mean of the images of the last second, until they are published
  std::uint64_t late = 0;  ///< images that took longer than their time, ever
  /// Name and times, StageTimes::words().
  std::vector<std::pair<std::string, std::string>> stages;
  std::vector<OutputState> outputs;
  std::vector<LayerStatus> layers;
  std::map<std::string, double> silent_s;  ///< since the last message; absent: there was none
};

/// Makes a status for each projector (an error while it is dark because something is missing, a
/// warning while a layer lacks something, no content lies in the light, drawing takes longer
/// than it has, or light lies far from its place because the projector moves) and one for each
/// layer (a warning once something was dropped, while all of its content is dark, or while its
/// topic has another type). In words that say why the floor is dark.
diagnostic_msgs::DiagnosticArray toDiagnostics(const ProjectorState& state);

/// Chooses what is worth a line in the log. Bounded as the reasons of layers are. One thread at a
/// time.
class FaultLog {
 public:
  static constexpr std::int64_t kAgainNs = 30'000'000'000;  ///< time between two lines on one fault

  /// The lines for this moment (of any clock that does not run backwards): problems that stand, and
  /// what layers dropped or found odd since the last line about it.
  std::vector<std::string> news(const std::vector<std::string>& problems,
                                const std::vector<LayerStatus>& layers, std::int64_t now_ns);

 private:
  struct Said {
    std::uint64_t count;
    std::int64_t at_ns;
  };
  void add(std::vector<std::string>& lines, const std::string& prefix,
           const std::map<std::string, std::uint64_t>& reasons, std::int64_t now_ns);

  std::map<std::string, Said> counted_;
  std::map<std::string, std::int64_t> standing_;  ///< problems, and when each was last said
};

/// Counts images, publishes and logs. countImage() from any thread, the rest from one.
class ProjectorDiagnostics {
 public:
  explicit ProjectorDiagnostics(double wanted_hz);

  void countImage(std::chrono::steady_clock::duration drawing);
  /// Completes the state with the node's name and rates. `watch`: the drift watch's status.
  void publish(ProjectorState state,
               const std::optional<diagnostic_msgs::DiagnosticStatus>& watch);

 private:
  struct Heard {
    std::uint64_t received;
    std::chrono::steady_clock::time_point at;
  };
  void addSilences(ProjectorState& state);
  void log(const ProjectorState& state);

  const double wanted_hz_;
  std::atomic<std::uint64_t> drawn_{0}, late_{0};
  std::atomic<std::int64_t> drawing_ns_{0};  ///< all images, ever
  std::uint64_t drawn_before_ = 0;
  std::int64_t drawing_ns_before_ = 0;
  std::map<std::string, Heard> heard_;  ///< messages heard, by topic
  std::chrono::steady_clock::time_point counted_at_;
  FaultLog faults_;
  ros::NodeHandle nh_;
  ros::Publisher publisher_;
};

}  // namespace afterglow::nodes
