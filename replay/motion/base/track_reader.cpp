#include "replay/motion/base/track_reader.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <string_view>
#include <vector>

#include "replay/messages/field_edit.hpp"
#include "replay/messages/ranges.hpp"
#include "replay/messages/robot_names.hpp"
#include "replay/messages/wire.hpp"
#include "replay/motion/base/track_builder.hpp"

namespace afterglow::replay {
namespace {

constexpr std::size_t kMostPairs = 12;              // that a refusal lists
constexpr std::int64_t kStanding = 10'000'000'000;  // ns after the end that may tell of it
// Names that these frames have on other robots, too: on TIAGo and TurtleBots, on PR2.
constexpr std::array<std::string_view, 2> kOdometryFrames{"odom", "odom_combined"};
constexpr std::array<std::string_view, 2> kBaseFrames{"base_link", "base_footprint"};

const std::vector<FieldPath>& transformPaths() {
  static const std::vector<FieldPath> kPaths = [] {
    std::vector<FieldPath> paths;
    for (const char* field :
         {"header.stamp", "header.frame_id", "child_frame_id", "transform.translation.x",
          "transform.translation.y", "transform.rotation.x", "transform.rotation.y",
          "transform.rotation.z", "transform.rotation.w"}) {
      paths.push_back(FieldPath::parse(std::string("transforms[].") + field));
    }
    return paths;
  }();
  return kPaths;
}

std::string lastName(const std::string& frame) { return frame.substr(frame.rfind('/') + 1); }

/// The transforms of one message.
class Transforms {
 public:
  Transforms(const FieldFinder& finder, const Bytes& bytes)
      : bytes_(bytes), spans_(finder.find(bytes)) {}

  std::size_t count() const { return spans_[0].size(); }
  Stamp stamp(std::size_t i) const { return readTime(bytes_, spans_[0][i]).value_or(Stamp{}); }
  std::string parent(std::size_t i) const { return bareName(readString(bytes_, spans_[1][i])); }
  std::string child(std::size_t i) const { return bareName(readString(bytes_, spans_[2][i])); }
  /// Seen from above. Empty if it is no rigid transform.
  std::optional<PlanarPose> pose(std::size_t i) const {
    const double x = number(5, i), y = number(6, i), z = number(7, i), w = number(8, i);
    const double length = x * x + y * y + z * z + w * w;
    const PlanarPose pose{number(3, i), number(4, i), headingOf(x, y, z, w)};
    // NaN compares false.
    if (!(length > 0.9 && length < 1.1 && std::isfinite(pose.x) && std::isfinite(pose.y)))
      return {};
    return pose;
  }

 private:
  double number(std::size_t path, std::size_t i) const {
    const FieldSpan& span = spans_[path][i];
    if (span.type != FieldType::Float64) throw MessageError("a transform of other numbers");
    return loadNumber<double>(bytes_.data() + span.offset);
  }

  const Bytes& bytes_;
  std::vector<std::vector<FieldSpan>> spans_;
};

class TrackReading {
 public:
  TrackReading(const Store& store, const TrackFrames& frames, const LocalizationNoise& noise)
      : store_(store),
        map_(bareName(frames.map)),
        odometry_(bareName(frames.odometry)),
        base_(bareName(frames.base)),
        builder_(noise) {}

  /// Poses after the end only tell where the base ended, as long as it stands there.
  void endTrack() { is_ended_ = true; }
  bool hasMovedOn() const { return has_moved_on_; }

  void add(const Message& message) {
    const FieldFinder* finder = finderOf(message.channel);
    if (!finder) {
      ++unreadable_;
      return;
    }
    try {
      const Transforms transforms(*finder, message.bytes);
      for (std::size_t i = 0; i < transforms.count(); ++i) add(transforms, i, message.received);
    } catch (const MessageError&) {
      ++unreadable_;
    }
  }

  std::optional<PoseTrack> finish(const std::string& topic, std::string& why) {
    if (!builder_.hasOdometry()) {
      why = "no " + odometry_ + " -> " + base_ + " was recorded on " + topic + pairsSeen() +
            framesAdvice();
      return {};
    }
    PoseTrack track = builder_.build(map_, odometry_, delay_);
    if (unreadable_ > 0) {
      track.remarks.push_back(std::to_string(unreadable_) + " messages or transforms on " + topic +
                              " could not be read");
    }
    return track;
  }

 private:
  void add(const Transforms& transforms, std::size_t i, Stamp received) {
    const std::string parent = transforms.parent(i), child = transforms.child(i);
    const bool is_odometry = parent == odometry_ && child == base_;
    if (!is_odometry && !(parent == map_ && child == odometry_)) {
      if (pairs_.size() < kMostPairs) pairs_.insert(parent + " -> " + child);
      // Of several robots they stand behind a prefix.
      if (contains(kOdometryFrames, lastName(parent)) && contains(kBaseFrames, lastName(child))) {
        likely_.insert("odom=" + parent + " base=" + child);
      }
      return;
    }
    const std::optional<PlanarPose> pose = transforms.pose(i);
    if (!pose) {
      ++unreadable_;
    } else if (is_odometry && is_ended_) {
      has_moved_on_ = !builder_.endsAt(*pose);
    } else if (is_odometry) {
      // Arrival jitters; the robot's clock does not, but may be another than the recorder's.
      delay_ = std::min(delay_, received.ns - transforms.stamp(i).ns);
      builder_.addOdometry(transforms.stamp(i), *pose);
    } else {
      builder_.addLocalization(received, *pose);
    }
  }

  std::string pairsSeen() const {
    if (pairs_.empty()) return "";
    std::string text;
    for (const std::string& pair : pairs_) text += (text.empty() ? "; there are " : ", ") + pair;
    return text;
  }

  std::string framesAdvice() const {
    std::string text;
    for (const std::string& frames : likely_) {
      text += (text.empty() ? "; perhaps --base-frame " : " or ") + frames;
    }
    return text;
  }

  const FieldFinder* finderOf(std::int64_t channel) {
    const auto known = finders_.find(channel);
    if (known != finders_.end()) return known->second ? &*known->second : nullptr;
    std::optional<FieldFinder>& finder = finders_[channel];
    try {
      const Channel described = store_.channel(channel);
      finder.emplace(Schema::of(described), transformPaths());
    } catch (const MessageError&) {
      // Something else on this topic.
    }
    return finder ? &*finder : nullptr;
  }

  const Store& store_;
  std::string map_, odometry_, base_;
  TrackBuilder builder_;
  std::map<std::int64_t, std::optional<FieldFinder>> finders_;
  std::set<std::string> pairs_;
  std::set<std::string> likely_;  ///< names as --base-frame takes them
  std::int64_t delay_ = std::numeric_limits<std::int64_t>::max();  ///< the shortest seen
  std::uint64_t unreadable_ = 0;
  bool is_ended_ = false, has_moved_on_ = false;
};

}  // namespace

std::optional<PoseTrack> readPoseTrack(const Store& store, const Behavior& behavior,
                                       const TrackFrames& frames, const LocalizationNoise& noise,
                                       std::string& why, std::optional<Stamp> begin,
                                       std::optional<Stamp> end) {
  TrackReading reading(store, frames, noise);
  const auto read = [&](const Behavior& of, std::optional<Stamp> from, std::optional<Stamp> to) {
    const auto messages = store.messages(of, {{frames.topic}, from, to});
    while (!reading.hasMovedOn()) {
      const std::optional<Message> message = messages->next();
      if (!message) break;
      reading.add(*message);
    }
  };
  read(behavior, begin, end);
  if (const std::optional<Stamp> last = end ? end : behavior.end) {
    reading.endTrack();
    Behavior longer = behavior;
    longer.end = Stamp{last->ns + kStanding};
    read(longer, last, longer.end);
  }
  return reading.finish(frames.topic, why);
}

}  // namespace afterglow::replay
