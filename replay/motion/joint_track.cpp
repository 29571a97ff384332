#include "replay/motion/joint_track.hpp"

#include <algorithm>
#include <cmath>

#include "replay/messages/document.hpp"
#include "replay/store/store_reading.hpp"

namespace afterglow::replay {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::int64_t kBefore = 5 * kSecond, kAfter = kSecond;
constexpr std::int64_t kThinnest = kSecond / 100;

void addMessage(const Schema& schema, const Message& message, JointTrack& track) {
  const Value document = decode(schema, message.bytes);
  const Value* name_value = findValue(document, "name");
  const auto* names = name_value ? std::get_if<Array>(name_value) : nullptr;
  const std::vector<double> positions = numbersAt(document, "position");
  for (std::size_t i = 0; names && i < std::min(names->size(), positions.size()); ++i) {
    if (const auto* name = std::get_if<std::string>(&(*names)[i])) {
      track.add(*name, message.received, positions[i]);
    }
  }
}

}  // namespace

Behavior aroundMoments(const Behavior& behavior, Stamp from, Stamp to) {
  Behavior wide = behavior;
  wide.begin = {from.ns - kBefore};
  wide.end = Stamp{to.ns + kAfter};
  return wide;
}

JointTrack JointTrack::read(const Store& store, const Behavior& behavior, Stamp from, Stamp to) {
  const Behavior wide = aroundMoments(behavior, from, to);
  std::vector<std::string> topics;
  for (const auto& known : {store.topics(wide), store.contextTopics(wide)}) {
    for (const TopicSummary& topic : known) {
      if (topic.type == "sensor_msgs/JointState") topics.push_back(topic.topic);
    }
  }
  JointTrack track;
  if (topics.empty()) return track;
  KnownChannels channels(store);
  const auto cursor = store.messages(wide, {topics});
  while (const auto message = cursor->next()) {
    try {
      addMessage(channels.schema(message->channel), *message, track);
    } catch (const MessageError&) {
      continue;
    }
  }
  return track;
}

void JointTrack::add(const std::string& joint, Stamp at, double position) {
  if (!std::isfinite(position)) return;
  std::vector<Sample>& samples = joints_[joint];
  // Of joint states that come faster, the newest stands for those since the last that was kept.
  const bool replaces = samples.size() > 1 && at.ns - samples[samples.size() - 2].at.ns < kThinnest;
  if (replaces) samples.pop_back();
  samples.push_back({at, position});
}

std::map<std::string, double> JointTrack::at(Stamp moment) const {
  std::map<std::string, double> positions;
  for (const auto& [joint, samples] : joints_) {
    const auto after =
        std::find_if(samples.begin(), samples.end(),
                     [moment](const Sample& sample) { return sample.at > moment; });
    const auto before = after == samples.begin() ? after : std::prev(after);
    const std::int64_t age = moment.ns - before->at.ns;
    const bool is_stale = age > kSecond && after != samples.end() && after->at.ns - moment.ns < age;
    positions[joint] = (is_stale ? after : before)->position;
  }
  return positions;
}

std::vector<std::string> JointTrack::names() const {
  std::vector<std::string> names;
  for (const auto& [joint, samples] : joints_) names.push_back(joint);
  return names;
}

double JointTrack::fastest(const std::string& joint, Stamp from, Stamp to) const {
  constexpr std::int64_t kOver = kSecond / 4, kStep = kSecond / 20;
  double fastest = 0;
  for (Stamp at = from; at < to; at.ns += kStep) {
    const auto before = around(joint, at, 0), after = around(joint, {at.ns + kOver}, 0);
    if (!before || !after) continue;
    fastest = std::max(fastest, std::abs(after->at - before->at) * kSecond / kOver);
  }
  return fastest;
}

std::optional<JointTrack::Reach> JointTrack::around(const std::string& joint, Stamp moment,
                                                    std::int64_t margin_ns) const {
  const auto known = joints_.find(joint);
  if (known == joints_.end()) {
    return std::nullopt;
  }
  const std::vector<Sample>& samples = known->second;
  const auto firstSince = [&samples](Stamp stamp) {
    return std::lower_bound(samples.begin(), samples.end(), stamp,
                            [](const Sample& sample, Stamp wanted) { return sample.at < wanted; });
  };
  const auto after = firstSince(moment);
  const auto before = after == samples.begin() ? after : std::prev(after);
  const auto next = after == samples.end() ? before : after;
  if (std::min(std::abs(moment.ns - before->at.ns), std::abs(next->at.ns - moment.ns)) > kSecond) {
    return std::nullopt;
  }
  const double share =
      next->at > before->at
          ? std::clamp(static_cast<double>(moment.ns - before->at.ns) /
                           static_cast<double>(next->at.ns - before->at.ns),
                       0.0, 1.0)
          : 0.0;
  Reach reach;
  reach.at = before->position + share * (next->position - before->position);
  reach.least = reach.most = reach.at;
  for (auto sample = firstSince({moment.ns - margin_ns});
       sample != samples.end() && sample->at.ns <= moment.ns + margin_ns; ++sample) {
    reach.least = std::min(reach.least, sample->position);
    reach.most = std::max(reach.most, sample->position);
  }
  return reach;
}

}  // namespace afterglow::replay
