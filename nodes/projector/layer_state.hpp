/// \file
/// The life cycle of a topic's markers, clouds, paths and so on from their arrival to the image
/// that is drawn. Semantics: RViz 1.14 (marker_display.cpp, point_cloud_common.cpp),
/// tf2_ros::MessageFilter.
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

#include "nodes/conversion/cloud_conversion.hpp"
#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/projector/frame_lookup.hpp"
#include "nodes/projector/layer_config.hpp"
#include "nodes/projector/topic_monitor.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::nodes {

/// Namespace and id of a marker; of all else {"", a number among them}.
using ContentKey = std::pair<std::string, int>;

/// The content of one message or marker, and how it is to be placed.
struct Content {
  std::vector<render::Drawable> drawables;  ///< drawables, whose poses lead into `frame`
  std::string frame;                        ///< frame without leading slash
  ros::Time stamp;                          ///< 0: the newest transform
  bool frame_locked = false;                ///< follows its frame; else it is placed once
  std::int64_t lifetime_ns = 0;             ///< lifetime from arrival; at most 0.1 ms: forever
  std::int64_t decay_ns = 0;                ///< decay from placement, as RViz counts it; 0: forever
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< offset in the fixed frame
  std::optional<AxisColor> axis_color;               ///< gives its clouds their colors
  Sweep sweep;                                       ///< sweep of its one cloud, if that is a scan
  std::string nothing;                               ///< the reason why there are no drawables
};

/// Messages other than markers as their layer is configured to show them.
/// Content without drawables clears the layer. Frame and stamp are left to the caller. Refusals and
/// remarks are the conversions'. Pure; never throws.
Converted<Content> toContent(const sensor_msgs::PointCloud2& message, const LayerConfig& config,
                             render::Workers* workers = nullptr);
Converted<Content> toContent(const sensor_msgs::LaserScan& message, const LayerConfig& config);
Converted<Content> toContent(const nav_msgs::Path& message, const LayerConfig& config);
Converted<Content> toContent(const geometry_msgs::PolygonStamped& message,
                             const LayerConfig& config);
Converted<Content> toContent(const geometry_msgs::PoseStamped& message, const LayerConfig& config);
Converted<Content> toContent(const geometry_msgs::PoseArray& message, const LayerConfig& config);
Converted<Content> toContent(const geometry_msgs::PoseWithCovarianceStamped& message,
                             const LayerConfig& config);
Converted<Content> toContent(const nav_msgs::Odometry& message, const LayerConfig& config);
Converted<Content> toContent(const nav_msgs::GridCells& message, const LayerConfig& config);
Converted<Content> toContent(const sensor_msgs::Range& message, const LayerConfig& config);
/// A grid follows its frame, whose newest transform counts, as in RViz: a map is sent once.
Converted<Content> toContent(const nav_msgs::OccupancyGrid& message, const LayerConfig& config);
/// `lens`: what the layer's camera_info tells; else absent.
Converted<Content> toContent(const sensor_msgs::Image& message, const LayerConfig& config,
                             const std::optional<calib::Lens>& lens);

/// Times are ROS time in nanoseconds and must not run backwards: removeAll() first. The numbers of
/// markers, points, waiting messages and distinct reasons are bounded. One thread at a time.
class LayerState {
 public:
  struct Limits {
    std::size_t shown = 20'000;
    std::size_t waiting = 20'000;
    /// The time that content waits for its transform: as long as tf2_ros keeps transforms.
    std::int64_t patience_ns = 10'000'000'000;
    /// Points in all clouds that decay, together: the oldest clouds go first.
    std::size_t points = std::size_t{1} << 22;
    /// Corners of all else together (render::cornersOf): each takes some 200 bytes while it is
    /// drawn.
    std::size_t corners = std::size_t{1} << 21;
  };

  LayerState(std::string topic, float alpha, Limits limits);

  /// Counts a message. What is put until the next call comes from it.
  void beginMessage() {
    ++status_.received;
    first_order_ = next_order_;
  }
  void drop(const std::string& reason) { status_.drop(reason); }
  void remark(const std::string& reason) { status_.remark(reason); }

  /// Shows content as soon as its transform is known; it replaces the earlier content of its key.
  void put(const ContentKey& key, Content content, std::int64_t now_ns, FrameLookup& frames);
  void remove(const ContentKey& key);
  /// remove(), because the newest message shows nothing.
  void clear(const ContentKey& key, const std::string& nothing);
  void removeAll();

  /// Shows the content whose transform has come, drops content that has waited too long, and
  /// removes expired content.
  void update(std::int64_t now_ns, FrameLookup& frames);
  /// Returns what to draw now, in the fixed frame, in the order of the keys.
  std::vector<render::Drawable> drawables(FrameLookup& frames);
  /// Returns what keeps content from being placed, in words, as of the last update() and
  /// drawables(); empty: nothing does. It becomes part of the status.
  const std::string& explain(FrameLookup& frames);

  LayerStatus status() const;
  /// Returns the stamp of the first content that is shown; empty: nothing is.
  std::optional<ros::Time> stampShown() const {
    return shown_.empty() ? std::nullopt : std::optional(shown_.begin()->second.content.stamp);
  }
  /// Returns true while content waits for a transform.
  bool isWaiting() const { return !waiting_.empty(); }

 private:
  struct Shown {
    Content content;
    Eigen::Isometry3d T_fixed_frame;  ///< transform as of its placement
    std::int64_t expires_ns;          ///< the greatest value means never
    std::uint64_t order;
    std::size_t corners = 0;  ///< 0 for what decays
  };
  struct Waiting {
    ContentKey key;
    Content content;
    std::int64_t arrived_ns;
    std::uint64_t order;
  };

  bool place(Waiting& waiting, std::int64_t now_ns, FrameLookup& frames);
  static std::string notPlaced(const Waiting& waiting, FrameLookup& frames);
  void evictPoints();
  std::map<ContentKey, Shown>::iterator erase(std::map<ContentKey, Shown>::iterator shown);

  float alpha_;
  Limits limits_;
  std::map<ContentKey, Shown> shown_;
  std::size_t corners_ = 0;  ///< corners in shown_
  std::deque<Waiting> waiting_;
  std::uint64_t next_order_ = 0;
  std::uint64_t first_order_ = 0;  ///< order of the message's contents
  std::string hidden_for_;
  LayerStatus status_;
};

}  // namespace afterglow::nodes
