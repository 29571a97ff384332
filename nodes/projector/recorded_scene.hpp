/// \file
/// A recorded behavior's scene at any of its moments, as projector_node would have had it live.
/// Needs no ROS master.
#pragma once

#include <tf2/buffer_core.h>

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "nodes/projector/projector_scene.hpp"
#include "render/compose/light_census.hpp"
#include "replay/store/store.hpp"
#include "replay/store/store_reading.hpp"

namespace afterglow::nodes {

/// The end of a behavior; if it has none, just behind its last message, context included.
replay::Stamp endOf(const replay::Store& store, const replay::Behavior& behavior);

/// Plays a behavior's layers and transforms into a ProjectorScene in the order of their arrival,
/// after the recording's earlier static transforms and the /tf of the seconds before. Keeps a
/// reference to the store. One thread at a time.
class RecordedScene {
 public:
  RecordedScene(const replay::Store& store, replay::Behavior behavior,
                const ProjectorConfig& config);

  /// The scene once everything up to and including this moment has arrived. Moments must not
  /// decrease. Throws replay::StoreError, and std::runtime_error for a topic that holds another
  /// type than the configuration says.
  SceneSnapshot at(replay::Stamp moment);

  /// The transforms as of the last at(); they live as long as this.
  const tf2::BufferCore& transforms() const { return transforms_; }
  std::vector<LayerStatus> status() const { return scene_.status(); }
  /// Returns all that the picture of `snapshot`, that of the last at(), does not show, with the
  /// reason, a line each: one list for `afterglow render` and the console. `is_lit`: the picture is
  /// not black; a black one has at least one reason.
  std::vector<std::string> whyDark(const SceneSnapshot& snapshot, render::LightCensus& census,
                                   bool is_lit) const;

 private:
  void feedEarlierTransforms();
  void findSurfaces();
  void feed(const replay::Message& message);
  void feedTransforms(const replay::Message& message, const replay::Channel& channel);
  void showWaiting(replay::Stamp now);
  void feedLayer(std::size_t layer, const replay::Message& message, const replay::Channel& channel);
  template <typename MessageType>
  void feedLayerAs(std::size_t layer, const replay::Message& message,
                   const replay::Channel& channel);

  const replay::Store& store_;
  replay::Behavior behavior_;
  tf2::BufferCore transforms_;
  ProjectorScene scene_;
  std::multimap<std::string, std::size_t> layers_;  ///< layers by topic, their own and second ones
  replay::KnownChannels channels_{store_};
  std::unique_ptr<replay::MessageCursor> cursor_;
  std::optional<replay::Message> next_;
  std::int64_t show_waiting_at_ns_ = 0;
};

}  // namespace afterglow::nodes
