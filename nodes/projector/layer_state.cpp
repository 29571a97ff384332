#include "nodes/projector/layer_state.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <variant>

#include "nodes/conversion/cloud_conversion.hpp"
#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/conversion/path_conversion.hpp"
#include "render/scene/tessellate.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();
constexpr std::int64_t kShortestLifetime = 100'000;  // ns; RViz takes less for "forever"
constexpr double kKnotSpacing = 0.01;                // s, between the poses of a moving scanner
constexpr double kMostKnots = 100;

std::int64_t later(std::int64_t ns, std::int64_t by_ns) {
  return by_ns > kNever - ns ? kNever : ns + by_ns;
}

std::int64_t expiry(const Content& content, std::int64_t arrived_ns) {
  const bool ends = content.lifetime_ns > kShortestLifetime;
  return ends ? later(arrived_ns, content.lifetime_ns) : kNever;
}

std::size_t pointsIn(const Content& content) {
  std::size_t points = 0;
  for (const render::Drawable& drawable : content.drawables) {
    const auto* cloud = std::get_if<render::PointCloud>(&drawable.shape);
    if (cloud != nullptr) points += cloud->points.size();
  }
  return points;
}

const char kTooMuch[] = "too much at once: more than 2 million corners on this topic";

/// Clouds that decay are counted by their points.
std::size_t cornersIn(const Content& content) {
  std::size_t corners = 0;
  if (content.decay_ns > 0) return corners;
  for (const render::Drawable& drawable : content.drawables) {
    corners += render::cornersOf(drawable.shape);
  }
  return corners;
}

/// A pose on the way of a moving scanner.
struct Knot {
  Eigen::Vector3d position;
  Eigen::Quaterniond rotation;
};

/// Empty outside the range of ros::Time.
std::optional<ros::Time> after(ros::Time stamp, double seconds) {
  constexpr std::int64_t kEnd = (std::int64_t{1} << 32) * 1'000'000'000;
  const std::int64_t ns = static_cast<std::int64_t>(stamp.toNSec()) + std::llround(seconds * 1e9);
  if (ns <= 0 || ns >= kEnd) return std::nullopt;
  ros::Time time;
  time.fromNSec(static_cast<std::uint64_t>(ns));
  return time;
}

/// The points as the frame would have seen all of them at `stamp`, given that the fixed frame stood
/// still. Empty while tf does not know the frame from the first ray's time to the last one's.
/// Between poses 10 ms apart motion is taken for steady. Semantics: laser_geometry's
/// transformLaserScanToPointCloud, which RViz uses, but with more than two poses for a scan.
std::optional<render::PointList> deskew(const render::PointList& points, const Sweep& sweep,
                                        const std::string& frame, ros::Time stamp,
                                        FrameLookup& frames) {
  const double spans = std::clamp(std::ceil(std::abs(sweep.last_s) / kKnotSpacing), 1., kMostKnots);
  std::vector<Knot> knots;
  std::optional<Eigen::Isometry3d> T_first_fixed;
  for (double i = 0; i <= spans; ++i) {
    const auto time = after(stamp, sweep.last_s * i / spans);
    const auto T_fixed_frame = time ? frames.at(frame, *time) : std::nullopt;
    if (!T_fixed_frame) return std::nullopt;
    if (!T_first_fixed) T_first_fixed = T_fixed_frame->inverse();
    const Eigen::Isometry3d T_first_now = *T_first_fixed * *T_fixed_frame;
    knots.push_back({T_first_now.translation(), Eigen::Quaterniond(T_first_now.linear())});
  }
  render::PointList placed;
  placed.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double along = std::clamp(sweep.seconds[i] / sweep.last_s, 0.0, 1.0) * spans;
    const auto k = static_cast<std::size_t>(std::min(std::floor(along), spans - 1));
    const double share = along - static_cast<double>(k);
    const Eigen::Vector3d position =
        knots[k].position + share * (knots[k + 1].position - knots[k].position);
    const Eigen::Quaterniond rotation = knots[k].rotation.slerp(share, knots[k + 1].rotation);
    placed.emplace_back((rotation * points[i].cast<double>() + position).cast<float>());
  }
  return placed;
}

/// Puts each ray of a scan where it was seen. False while a transform is missing.
bool unfoldSweep(Content& content, FrameLookup& frames) {
  if (content.sweep.seconds.empty() || content.stamp.isZero()) return true;
  auto& cloud = std::get<render::PointCloud>(content.drawables.at(0).shape);
  auto points = deskew(cloud.points, content.sweep, content.frame, content.stamp, frames);
  if (!points) return false;
  cloud.points = std::move(*points);
  return true;
}

/// Returns a reason without the seconds that a stale transform counts: equal faults are to be one
/// reason.
std::string countable(const std::string& reason) { return reason.substr(0, reason.find(": '")); }

Content cloudContent(render::PointCloud cloud, const LayerConfig& config) {
  Content content;
  content.decay_ns = config.decay_ns;
  if (cloud.points.empty()) return content;
  const CloudStyle& style = config.cloud;
  if (isAxis(style.color)) {
    const AxisColor color{axisOf(style.color), style.scale};
    if (style.axis_of_fixed_frame) {
      content.axis_color = color;
    } else {
      colorByAxis(cloud, color, Eigen::Isometry3d::Identity());
    }
  }
  // A cloud's own colors are not to be multiplied by the flat color.
  const bool is_flat = style.color == ColorSource::Flat;
  content.drawables.push_back(
      {{}, std::move(cloud), is_flat ? config.flat_color : render::Color{}});
  return content;
}

Converted<Content> contentOf(Converted<Drawables> shapes, const char* nothing) {
  if (!shapes.value) return refused<Content>(shapes.reason);
  Content content;
  content.drawables = std::move(*shapes.value);
  content.nothing = nothing;
  return {std::move(content), shapes.reason};
}

}  // namespace

LayerState::LayerState(std::string topic, float alpha, Limits limits)
    : alpha_(alpha), limits_(limits) {
  status_.topic = std::move(topic);
}

void LayerState::put(const ContentKey& key, Content content, std::int64_t now_ns,
                     FrameLookup& frames) {
  status_.nothing.clear();
  Waiting waiting{key, std::move(content), now_ns, next_order_++};
  if (place(waiting, now_ns, frames)) return;
  if (waiting_.size() >= limits_.waiting) {
    drop("too many waiting: " + countable(notPlaced(waiting_.front(), frames)));
    waiting_.pop_front();
  }
  waiting_.push_back(std::move(waiting));
}

bool LayerState::place(Waiting& waiting, std::int64_t now_ns, FrameLookup& frames) {
  Content& content = waiting.content;
  auto T_fixed_frame = frames.at(content.frame, content.stamp);
  if (!T_fixed_frame || !unfoldSweep(content, frames)) return false;
  const auto found = shown_.find(waiting.key);
  if (found == shown_.end() && shown_.size() >= limits_.shown) {
    drop("too many markers");
    return true;
  }
  // Content that came later may have been placed earlier.
  if (found != shown_.end() && found->second.order > waiting.order) return true;
  if (found != shown_.end() && found->second.order >= first_order_) {
    remark("an id twice in one array: the last is shown");
  }
  const std::size_t corners = cornersIn(content);
  const std::size_t others = corners_ - (found == shown_.end() ? 0 : found->second.corners);
  if (others > 0 && others + corners > limits_.corners) {
    drop(kTooMuch);
    if (found != shown_.end()) erase(found);
    return true;
  }
  T_fixed_frame->pretranslate(content.offset);
  for (render::Drawable& drawable : content.drawables) {
    auto* cloud = std::get_if<render::PointCloud>(&drawable.shape);
    if (cloud == nullptr || !content.axis_color) continue;
    colorByAxis(*cloud, *content.axis_color, *T_fixed_frame * drawable.pose.matrix());
  }
  const bool decays = content.decay_ns > 0;
  const std::int64_t expires_ns =
      decays ? later(now_ns, content.decay_ns) : expiry(content, waiting.arrived_ns);
  corners_ = others + corners;
  Shown shown{std::move(content), *T_fixed_frame, expires_ns, waiting.order, corners};
  if (found != shown_.end()) {
    found->second = std::move(shown);
  } else {
    shown_.emplace(waiting.key, std::move(shown));
  }
  if (decays) evictPoints();
  return true;
}

void LayerState::evictPoints() {
  std::size_t points = 0;
  for (const auto& [key, shown] : shown_) points += pointsIn(shown.content);
  while (points > limits_.points && shown_.size() > 1) {
    remark("too many points: what was shown longest is left out");
    points -= pointsIn(shown_.begin()->second.content);
    erase(shown_.begin());
  }
}

std::string LayerState::notPlaced(const Waiting& waiting, FrameLookup& frames) {
  const Content& content = waiting.content;
  return frames.notPlaced(content.frame, content.stamp, waiting.arrived_ns);
}

const std::string& LayerState::explain(FrameLookup& frames) {
  status_.missing.clear();
  if (!waiting_.empty()) {
    status_.missing = notPlaced(waiting_.front(), frames);
  } else if (!hidden_for_.empty()) {
    status_.missing = frames.notPlaced(hidden_for_, ros::Time(0), 0);
  }
  return status_.missing;
}

void LayerState::clear(const ContentKey& key, const std::string& nothing) {
  remove(key);
  status_.nothing = nothing;
}

std::map<ContentKey, LayerState::Shown>::iterator LayerState::erase(
    std::map<ContentKey, Shown>::iterator shown) {
  corners_ -= shown->second.corners;
  return shown_.erase(shown);
}

void LayerState::remove(const ContentKey& key) {
  const auto shown = shown_.find(key);
  if (shown != shown_.end()) erase(shown);
  const auto matches = [&key](const Waiting& waiting) { return waiting.key == key; };
  waiting_.erase(std::remove_if(waiting_.begin(), waiting_.end(), matches), waiting_.end());
}

void LayerState::removeAll() {
  shown_.clear();
  corners_ = 0;
  waiting_.clear();
}

void LayerState::update(std::int64_t now_ns, FrameLookup& frames) {
  std::deque<Waiting> still_waiting;
  for (Waiting& waiting : waiting_) {
    const bool expired = expiry(waiting.content, waiting.arrived_ns) <= now_ns;
    if (!expired && place(waiting, now_ns, frames)) continue;
    if (expired || now_ns - waiting.arrived_ns >= limits_.patience_ns) {
      drop(countable(notPlaced(waiting, frames)));
      continue;
    }
    still_waiting.push_back(std::move(waiting));
  }
  waiting_.swap(still_waiting);
  for (auto it = shown_.begin(); it != shown_.end();) {
    const bool is_over = it->second.expires_ns <= now_ns;
    if (is_over) ++status_.expired;
    it = is_over ? erase(it) : std::next(it);
  }
}

std::vector<render::Drawable> LayerState::drawables(FrameLookup& frames) {
  hidden_for_.clear();
  status_.invisible = 0;
  std::vector<render::Drawable> drawn;
  drawn.reserve(shown_.size());
  for (const auto& [key, shown] : shown_) {
    auto T_fixed_frame = std::optional<Eigen::Isometry3d>(shown.T_fixed_frame);
    if (shown.content.frame_locked) {
      T_fixed_frame = frames.at(shown.content.frame, ros::Time(0));
      if (!T_fixed_frame) {  // hidden until its frame returns
        hidden_for_ = shown.content.frame;
        continue;
      }
    }
    for (const render::Drawable& own : shown.content.drawables) {
      if (own.color.a * alpha_ <= 0) {
        ++status_.invisible;
        continue;
      }
      render::Drawable drawable = own;
      drawable.pose = Rigid<World, World>(*T_fixed_frame * drawable.pose.matrix());
      drawable.color.a *= alpha_;
      drawn.push_back(std::move(drawable));
    }
  }
  return drawn;
}

LayerStatus LayerState::status() const {
  LayerStatus status = status_;
  status.shown = shown_.size();
  status.waiting = waiting_.size();
  status.waiting_for = printable(waiting_.empty() ? hidden_for_ : waiting_.front().content.frame);
  return status;
}

Converted<Content> toContent(const sensor_msgs::PointCloud2& message, const LayerConfig& config,
                             render::Workers* workers) {
  auto cloud = toPointCloud(message, config.cloud, workers);
  if (!cloud.value) return refused<Content>(cloud.reason);
  Content content = cloudContent(std::move(*cloud.value), config);
  const bool has_points = message.width > 0 && message.height > 0;
  content.nothing = has_points ? "a cloud whose points are not finite" : "a cloud without points";
  return {std::move(content), cloud.reason};
}

Converted<Content> toContent(const sensor_msgs::LaserScan& message, const LayerConfig& config) {
  auto scan = toScanPoints(message, config.cloud);
  if (!scan.value) return refused<Content>(scan.reason);
  Content content = cloudContent(std::move(scan.value->cloud), config);
  content.sweep = std::move(scan.value->sweep);
  content.nothing = message.ranges.empty() ? "a scan without ranges" : "a scan without a return";
  return {std::move(content), scan.reason};
}

Converted<Content> toContent(const nav_msgs::Path& message, const LayerConfig& config) {
  auto shapes = toPathShapes(message, config.path);
  if (!shapes.value) return refused<Content>(shapes.reason);
  Content content;
  content.offset = config.offset;
  content.nothing = message.poses.empty()       ? "a path without poses"
                    : message.poses.size() == 1 ? "a path of one pose"
                                                : "a path without two poses apart";
  for (render::Lines& strip : shapes.value->strips) {
    content.drawables.push_back({{}, std::move(strip), config.flat_color});
  }
  if (shapes.value->glyphs) {
    const bool own_colors = config.path.poses == PathStyle::Poses::Axes;
    render::MeshInstance glyphs;
    glyphs.body = std::move(shapes.value->glyphs);
    glyphs.own_colors = own_colors;
    content.drawables.push_back(
        {{}, std::move(glyphs), own_colors ? render::Color{} : config.path.arrow_color});
  }
  return {std::move(content), shapes.reason};
}

Converted<Content> toContent(const geometry_msgs::PolygonStamped& message,
                             const LayerConfig& config) {
  return contentOf(toPolygonShapes(message.polygon, config.path, config.filled, config.flat_color),
                   "a polygon without two points apart");
}

Converted<Content> toContent(const geometry_msgs::PoseStamped& message, const LayerConfig& config) {
  return contentOf(toPoseShapes({message.pose}, config.path), "");
}

Converted<Content> toContent(const geometry_msgs::PoseArray& message, const LayerConfig& config) {
  return contentOf(toPoseShapes(message.poses, config.path), "an array without poses");
}

Converted<Content> toContent(const geometry_msgs::PoseWithCovarianceStamped& message,
                             const LayerConfig& config) {
  return contentOf(toPoseShapes(message.pose, config.path, config.covariance), "");
}

Converted<Content> toContent(const nav_msgs::Odometry& message, const LayerConfig& config) {
  return contentOf(toPoseShapes(message.pose, config.path, config.covariance), "");
}

Converted<Content> toContent(const nav_msgs::GridCells& message, const LayerConfig& config) {
  return contentOf(toCellShapes(message, config.flat_color), "a grid without cells");
}

Converted<Content> toContent(const sensor_msgs::Range& message, const LayerConfig& config) {
  return contentOf(toConeShapes(message, config.flat_color), "a range without a return");
}

Converted<Content> toContent(const nav_msgs::OccupancyGrid& message, const LayerConfig& config) {
  auto content = contentOf(toMapShapes(message, config.color_scheme), "a map without a lit cell");
  if (content.value) content.value->frame_locked = true;
  return content;
}

Converted<Content> toContent(const sensor_msgs::Image& message, const LayerConfig& config,
                             const std::optional<calib::Lens>& lens) {
  ImagePlane plane = config.image;
  plane.lens = lens;
  return contentOf(toImageShapes(message, plane), "an image whose pixels no ray of its lens meets");
}

}  // namespace afterglow::nodes
