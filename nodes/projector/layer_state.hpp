/// \file
/// What one topic has on display: the life cycle of markers, clouds, scans and paths between their
/// arrival and the frame that is drawn. Semantics: RViz 1.14 (marker_display.cpp,
/// point_cloud_common .cpp), tf2_ros::MessageFilter.
#pragma once

#include <ros/time.h>

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "nodes/conversion/cloud_color.hpp"
#include "nodes/conversion/scan_conversion.hpp"
#include "nodes/projector/frame_lookup.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::nodes {

/// Namespace and id of a marker; clouds, scans and paths are {"", place in a row of them}.
using ContentKey = std::pair<std::string, int>;

/// What one message or marker shows, and how it is to be placed.
struct Content {
  std::vector<render::Drawable> drawables;  ///< their poses lead into `frame`
  std::string frame;                        ///< without leading slash
  ros::Time stamp;                          ///< 0: the newest transform
  bool frame_locked = false;                ///< follows its frame; else it is placed once
  std::int64_t lifetime_ns = 0;             ///< from arrival; at most 0.1 ms: forever
  std::int64_t decay_ns = 0;                ///< from placement, as RViz counts it; 0: forever
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< in the fixed frame
  std::optional<AxisColor> axis_color;               ///< gives its clouds their colors
  Sweep sweep;                                       ///< of its one cloud, if that is a scan
};

/// What happened on a topic, for people.
struct LayerStatus {
  std::string topic;
  std::uint64_t received = 0;  ///< messages
  std::size_t shown = 0;
  std::size_t waiting = 0;  ///< for a transform
  std::string waiting_for;  ///< a frame, if something waits or is hidden for want of it
  std::map<std::string, std::uint64_t> dropped;  ///< reason -> how often
  std::map<std::string, std::uint64_t> remarks;  ///< shown, but odd
};

/// ROS time everywhere, as nanoseconds; it must not run backwards (clear() first). One thread at a
/// time. Bounded: so many markers, points, waiting messages and distinct reasons, and no more.
class LayerState {
 public:
  struct Limits {
    std::size_t shown = 20'000;
    std::size_t waiting = 20'000;
    /// How long content waits for its transform: as long as tf2_ros keeps transforms.
    std::int64_t patience_ns = 10'000'000'000;
    /// In all clouds shown that decay: the oldest go first.
    std::size_t points = std::size_t{1} << 22;
  };

  LayerState(std::string topic, float alpha, Limits limits);

  void countMessage() { ++status_.received; }
  void drop(const std::string& reason);
  void remark(const std::string& reason);

  /// Shows content in the place of what its key showed before: as soon as its transform is there.
  void put(const ContentKey& key, Content content, std::int64_t now_ns, FrameLookup& frames);
  void remove(const ContentKey& key);
  void removeAll();

  /// Lets waiting content in, or drops it when its patience is over; ends what has expired.
  void update(std::int64_t now_ns, FrameLookup& frames);
  /// What to draw now, in the fixed frame, in the order of the keys.
  std::vector<render::Drawable> drawables(FrameLookup& frames);

  LayerStatus status() const;
  bool isWaiting() const { return !waiting_.empty(); }  ///< something, for its transform

 private:
  struct Shown {
    Content content;
    Eigen::Isometry3d T_fixed_frame;  ///< as of its placement
    std::int64_t expires_ns;          ///< greatest value: never
    std::uint64_t order;
  };
  struct Waiting {
    ContentKey key;
    Content content;
    std::int64_t arrived_ns;
    std::uint64_t order;
  };

  bool place(Waiting& waiting, std::int64_t now_ns, FrameLookup& frames);
  void evictPoints();
  void count(std::map<std::string, std::uint64_t>& reasons, const std::string& reason);

  float alpha_;
  Limits limits_;
  std::map<ContentKey, Shown> shown_;
  std::deque<Waiting> waiting_;
  std::uint64_t next_order_ = 0;
  std::string hidden_for_;
  LayerStatus status_;
};

}  // namespace afterglow::nodes
