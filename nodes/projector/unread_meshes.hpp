/// \file
/// Markers that wait for their meshes, which are read beside the drawing.
#pragma once

#include <ros/time.h>
#include <visualization_msgs/Marker.h>

#include <cstddef>
#include <future>
#include <list>
#include <vector>

#include "nodes/conversion/mesh_library.hpp"
#include "nodes/projector/layer_state.hpp"

namespace afterglow::nodes {

using FutureMesh = std::shared_future<MeshLibrary::Mesh>;
/// Or refused.
bool isRead(const FutureMesh& mesh);

/// A marker of a layer, as it arrived.
struct UnreadMesh {
  std::size_t layer = 0;
  visualization_msgs::Marker marker;
  ros::Time arrived;
  FutureMesh mesh;

  ContentKey key() const { return {marker.ns, marker.id}; }
};

/// Meshes in the order of their arrival, one for each layer and key. One thread at a time.
class UnreadMeshes {
 public:
  static constexpr std::size_t kMost = 1000;

  /// False: too many wait; this one is not kept.
  bool add(UnreadMesh unread);
  void remove(std::size_t layer, const ContentKey& key);
  void removeAll(std::size_t layer);
  void clear() { waiting_.clear(); }
  /// Returns those whose meshes have been read or refused by now; they do not wait any more.
  std::vector<UnreadMesh> takeRead();
  const std::list<UnreadMesh>& waiting() const { return waiting_; }

 private:
  std::list<UnreadMesh> waiting_;
};

}  // namespace afterglow::nodes
