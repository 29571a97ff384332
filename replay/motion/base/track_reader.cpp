#include "replay/motion/base/track_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <stdexcept>
#include <string_view>
#include <tuple>
#include <vector>

#include "replay/messages/field_edit.hpp"
#include "replay/messages/ranges.hpp"
#include "replay/messages/topic_name.hpp"
#include "replay/messages/wire.hpp"

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

namespace {

using Sample = PoseTrack::Sample;

constexpr std::size_t kMostSamples = 200'000;
constexpr std::int64_t kGap = 500'000'000;
constexpr std::size_t kMostGaps = 1000;
// A base at rest: its odometry stays within this.
constexpr double kStill = 0.002, kTurnStill = 0.002;  // m, rad
constexpr std::int64_t kShortestStand = 1'000'000'000;
constexpr double kFewMeasurements = 5;  // too few to tell their noise
constexpr double kTelling = 0.5;        // m, on which a localization that errs moves the base
constexpr std::size_t kJumpMean = 5;  // measurements on either side that tell a jump's size

bool isStill(const PlanarPose& a, const PlanarPose& b) {
  return distance(a, b) < kStill && std::abs(wrapAngle(a.yaw - b.yaw)) < kTurnStill;
}

/// Drops each second sample; the last is kept.
void halve(std::vector<Sample>& samples) {
  const Sample last = samples.back();
  std::size_t kept = 0;
  for (std::size_t i = 0; i + 1 < samples.size(); i += 2) samples[kept++] = samples[i];
  samples.resize(kept);
  samples.push_back(last);
}

void addSpaced(std::vector<Sample>& samples, std::int64_t& spacing, const Sample& sample) {
  if (!samples.empty() && sample.stamp.ns - samples.back().stamp.ns < spacing) return;
  samples.push_back(sample);
  if (samples.size() < kMostSamples) return;
  halve(samples);
  spacing *= 2;
}

}  // namespace

void TrackBuilder::addOdometry(Stamp stamp, const PlanarPose& T_odom_base) {
  if (!poses_.empty() && stamp <= last_heard_) {
    if (stamp < last_heard_) ++out_of_order_;
    return;
  }
  if (!poses_.empty() && stamp.ns - last_heard_.ns > kGap && gaps_.size() < kMostGaps) {
    gaps_.push_back({last_heard_, stamp});
  }
  last_heard_ = stamp;
  last_pose_ = T_odom_base;
  addSpaced(poses_, pose_spacing_, {stamp, T_odom_base});
}

bool TrackBuilder::endsAt(const PlanarPose& T_odom_base) const {
  return hasOdometry() && isStill(last_pose_, T_odom_base);
}

void TrackBuilder::addLocalization(Stamp stamp, const PlanarPose& T_map_odom) {
  if (!corrections_.empty() && corrections_.back().pose == T_map_odom) return;
  addSpaced(corrections_, correction_spacing_, {stamp, T_map_odom});
}

PoseTrack TrackBuilder::build(const std::string& map_frame, const std::string& odometry_frame,
                              std::int64_t odometry_shift) {
  if (poses_.empty()) throw std::invalid_argument("a pose track needs odometry");
  for (Sample& sample : poses_) sample.stamp.ns += odometry_shift;
  for (TrackSpan& gap : gaps_) {
    gap.from.ns += odometry_shift;
    gap.to.ns += odometry_shift;
  }
  std::vector<TrackSpan> stands = findStands();
  const bool is_localized = isLocalized();
  std::vector<TrackJump> jumps = closeJumps();
  const PoseError measured = is_localized ? measuredError() : PoseError();
  std::pair<PoseError, PoseError> errors;
  if (is_localized) errors = smooth(measured);
  PoseTrack track(std::move(poses_), is_localized ? map_frame : odometry_frame, is_localized);
  track.measured_error = measured;
  std::tie(track.begin_error, track.end_error) = errors;
  if (!is_localized) {
    track.remarks.push_back("no " + map_frame + " -> " + odometry_frame +
                            " was recorded: the base is followed in " + odometry_frame +
                            ", from wherever it starts");
  }
  for (const TrackSpan& gap : gaps_) {
    track.remarks.push_back(
        fmt::format("no base pose for {:.1f} s, {:.1f} s after the track's begin",
                    secondsBetween(gap.from, gap.to), secondsBetween(track.begin(), gap.from)));
  }
  for (const TrackJump& jump : jumps) {
    track.remarks.push_back(fmt::format(
        "localization jumped by {:.2f} m and {:.1f} deg, {:.1f} s after the track's begin; what "
        "came before was moved along",
        jump.distance, jump.turn * kDegreesPerRadian, secondsBetween(track.begin(), jump.at)));
  }
  if (out_of_order_ > 0) {
    track.remarks.push_back(std::to_string(out_of_order_) + " base poses came out of order");
  }
  track.stands = std::move(stands);
  track.gaps = std::move(gaps_);
  track.jumps = std::move(jumps);
  return track;
}

/// Finds stands in the odometry, before localization's noise comes into the poses.
std::vector<TrackSpan> TrackBuilder::findStands() const {
  std::vector<TrackSpan> stands;
  for (std::size_t i = 0; i < poses_.size();) {
    std::size_t last = i;
    while (last + 1 < poses_.size() && isStill(poses_[i].pose, poses_[last + 1].pose)) ++last;
    const TrackSpan stand{poses_[i].stamp, poses_[last].stamp};
    const bool is_stand = stand.to.ns - stand.from.ns >= kShortestStand;
    if (is_stand) stands.push_back(stand);
    i = is_stand ? last + 1 : i + 1;
  }
  return stands;
}

PlanarPose TrackBuilder::odometryAt(Stamp stamp) const {
  const auto after =
      std::lower_bound(poses_.begin(), poses_.end(), stamp,
                       [](const Sample& sample, Stamp wanted) { return sample.stamp < wanted; });
  return after == poses_.end() ? poses_.back().pose : after->pose;
}

/// Returns where corrections [begin, end) put a base, in the mean.
PlanarPose TrackBuilder::meanBase(std::size_t begin, std::size_t end,
                                  const PlanarPose& T_odom_base) const {
  const PlanarPose first = compose(corrections_[begin].pose, T_odom_base);
  PlanarPose sum;
  for (std::size_t i = begin; i < end; ++i) {
    const PlanarPose base = compose(corrections_[i].pose, T_odom_base);
    sum.x += base.x - first.x;
    sum.y += base.y - first.y;
    sum.yaw += wrapAngle(base.yaw - first.yaw);
  }
  const auto count = static_cast<double>(end - begin);
  return {first.x + sum.x / count, first.y + sum.y / count, wrapAngle(first.yaw + sum.yaw / count)};
}

std::vector<TrackJump> TrackBuilder::closeJumps() {
  std::vector<std::size_t> at;  // of each stretch without a jump: its first correction
  for (std::size_t i = 1; i < corrections_.size(); ++i) {
    const PlanarPose odometry = odometryAt(corrections_[i].stamp);
    if (isJump(compose(corrections_[i - 1].pose, odometry), compose(corrections_[i].pose, odometry),
               noise_)) {
      at.push_back(i);
    }
  }
  std::vector<TrackJump> jumps(at.size());
  std::vector<PlanarPose> moves(at.size());  // of the poses before each
  PlanarPose move;
  for (std::size_t k = at.size(); k-- > 0;) {
    const std::size_t begin = k > 0 ? at[k - 1] : 0;
    const std::size_t end = k + 1 < at.size() ? at[k + 1] : corrections_.size();
    const PlanarPose odometry = odometryAt(corrections_[at[k]].stamp);
    const PlanarPose before =
        meanBase(std::max(begin, at[k] - std::min(at[k], kJumpMean)), at[k], odometry);
    const PlanarPose after = meanBase(at[k], std::min(end, at[k] + kJumpMean), odometry);
    jumps[k] = {corrections_[at[k]].stamp, distance(before, after),
                wrapAngle(after.yaw - before.yaw)};
    move = compose(move, compose(after, inverse(before)));
    moves[k] = move;
  }
  for (std::size_t k = 0; k < at.size(); ++k) {
    for (std::size_t i = k > 0 ? at[k - 1] : 0; i < at[k]; ++i) {
      corrections_[i].pose = compose(moves[k], corrections_[i].pose);
    }
  }
  return jumps;
}

/// Two measurements of the same error are as far apart as twice its variance, on each axis. Where
/// few were made, the noise that is assumed counts for the others; a base that drove without its
/// localization ever changing is localized exactly.
PoseError TrackBuilder::measuredError() const {
  double squares = 0, turn_squares = 0, gone = 0;
  for (std::size_t i = 1; i < corrections_.size(); ++i) {
    const PlanarPose odometry = odometryAt(corrections_[i].stamp);
    const PlanarPose before = compose(corrections_[i - 1].pose, odometry);
    const PlanarPose after = compose(corrections_[i].pose, odometry);
    const double way = distance(before, after), turn = wrapAngle(after.yaw - before.yaw);
    squares += way * way / 4;
    turn_squares += turn * turn / 2;
  }
  for (std::size_t i = 1; i < poses_.size(); ++i) {
    gone += distance(poses_[i - 1].pose, poses_[i].pose);
  }
  const auto count = static_cast<double>(corrections_.size() - 1);
  if (count == 0 && gone > kTelling) {
    return {};
  }
  const double assumed = std::max(0.0, kFewMeasurements - count), all = count + assumed;
  return {std::sqrt((squares + assumed * noise_.position * noise_.position) / all),
          std::sqrt((turn_squares + assumed * noise_.yaw * noise_.yaw) / all)};
}

/// Returns how well the begin and the end are known.
std::pair<PoseError, PoseError> TrackBuilder::smooth(const PoseError& measured) {
  BaseLocalizer localizer(noise_, corrections_.front().pose, poses_.front().pose,
                          corrections_.front().stamp);
  std::size_t next = 0;
  for (const Sample& sample : poses_) {
    localizer.move(sample.pose);
    for (; next < corrections_.size() && corrections_[next].stamp <= sample.stamp; ++next) {
      localizer.correct(corrections_[next].pose, corrections_[next].stamp);
    }
  }
  for (; next < corrections_.size(); ++next) {
    localizer.correct(corrections_[next].pose, corrections_[next].stamp);
  }
  const PoseError end = localizer.error(measured);
  // The pass backward starts with the scales learned on the whole drive; the end stays.
  for (std::size_t i = poses_.size(); i-- > 0;) {
    localizer.move(poses_[i].pose);
    poses_[i].pose = localizer.pose();
    for (; next > 0 && i > 0 && corrections_[next - 1].stamp > poses_[i - 1].stamp; --next) {
      localizer.correct(corrections_[next - 1].pose, corrections_[next - 1].stamp);
    }
  }
  return {localizer.error(measured), end};
}

}  // namespace afterglow::replay
