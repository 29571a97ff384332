#include "nodes/ros2/ros2_stops.hpp"

#include <ros/console.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>
#include <utility>

#include "nodes/tools/ros_graph.hpp"
#include "replay/messages/text.hpp"
#include "replay/messages/topic_name.hpp"
#include "replay/ros2/message_to_ros2.hpp"
#include "replay/ros2/ros2_definition.hpp"
#include "replay/ros2/twist_stamp.hpp"

namespace afterglow::nodes {
namespace {

constexpr double kMeeting_s = 1;  // nodes that are known are met within milliseconds
/// Whoever drives a base sends more often: it would stop after 0.25 s.
constexpr double kDriverPeriod_s = 0.4;
constexpr std::chrono::milliseconds kTypeLook(20);
constexpr const char* kCancel = "/cancel";
const DdsQos kStops{true, false, 10};
const DdsQos kDrivers{false, false, 10};

/// The encapsulation, a goal's id of zeros and the time zero: all goals.
const replay::Bytes kAllGoals = [] {
  replay::Bytes request(4 + 16 + 8);
  request[1] = 1;  // little endian
  return request;
}();

/// What a robot of ROS 2 does not have.
class NoWay : public StopWay {
 public:
  std::uint32_t heardBy() const override { return 0; }
  void publish(const StopMessage&) override {}
};

class CancelWay : public StopWay {
 public:
  CancelWay(DdsParticipant& participant, const replay::ServiceNames& names)
      : client_(participant, names, [](std::int64_t, replay::Bytes&&) {}) {}

  std::uint32_t heardBy() const override { return client_.isServed() ? 1 : 0; }
  void publish(const StopMessage&) override {
    try {
      client_.send(kAllGoals);
    } catch (const std::runtime_error& error) {
      ROS_ERROR_STREAM_THROTTLE(1, error.what());
    }
  }

 private:
  DdsServiceClient client_;
};

/// A velocity of another node than the bridges means that somebody else drives.
class MessageWay : public StopWay {
 public:
  MessageWay(DdsParticipant& participant, const GuardOutput& output, const DdsEndpoint& reader,
             const replay::MessageToRos2& conversion)
      : topic_(output.topic),
        conversion_(conversion),
        writer_(participant, reader.topic, reader.type, kStops) {
    if (replay::otherTwist(output.type).empty()) return;
    drivers_ = std::make_unique<DdsReader>(participant, reader.topic, reader.type, kDrivers,
                                           [this, &participant](DdsSample&& sample) {
                                             if (participant.qosOf(sample.writer))
                                               is_driven_ = true;
                                           });
  }

  std::uint32_t heardBy() const override {
    return static_cast<std::uint32_t>(writer_.matched().size());
  }
  bool hasMet(const DdsEndpoint& reader) const {
    const std::vector<DdsGuid> matched = writer_.matched();
    return std::find(matched.begin(), matched.end(), reader.guid) != matched.end();
  }
  void publish(const StopMessage& stop) override {
    try {
      const replay::Stamp now{static_cast<std::int64_t>(ros::Time::now().toNSec())};
      writer_.write(conversion_.convert(stop.bytes, now));
    } catch (const std::runtime_error& error) {
      ROS_ERROR_STREAM_THROTTLE(1, topic_ << ": " << error.what());
    }
  }
  std::string objection() const override {
    return is_driven_ ? "a node of ROS 2 drives on " + topic_ +
                            ", too: two drivers of one base are refused"
                      : "";
  }

 private:
  const std::string topic_;
  const replay::MessageToRos2 conversion_;
  std::atomic<bool> is_driven_{false};
  DdsWriter writer_;
  std::unique_ptr<DdsReader> drivers_;  ///< last: its thread uses the rest
};

std::vector<DdsEndpoint> endpointsOf(const std::vector<DdsEndpoint>& all, const std::string& topic,
                                     bool are_writers) {
  std::vector<DdsEndpoint> found;
  std::copy_if(all.begin(), all.end(), std::back_inserter(found),
               [&](const auto& one) { return one.is_writer == are_writers && one.topic == topic; });
  return found;
}

}  // namespace

GuardedPlayer::Ways Ros2Stops::ways(const GuardOutputs& outputs, const GuardedPlayer::Ways& known) {
  GuardedPlayer::Ways ways;
  for (const GuardOutput& output : outputs.outputs) {
    const auto found = known.find(output.topic);
    const bool is_heard = found != known.end() && found->second->heardBy() > 0;
    ways[output.topic] = is_heard ? found->second : wayOf(output);
  }
  return ways;
}

std::shared_ptr<StopWay> Ros2Stops::wayOf(const GuardOutput& output) {
  const std::vector<DdsEndpoint> all = participant_.endpoints();
  if (output.type != replay::kGoalIdType || !replay::endsWith(output.topic, kCancel)) {
    return messageWay(output, all);
  }
  const std::string action = replay::actionOf(output.topic);
  const replay::ServiceNames names =
      replay::serviceNames(action + "/_action/cancel_goal", "action_msgs/srv/CancelGoal");
  if (endpointsOf(all, names.request_topic, false).empty()) return std::make_shared<NoWay>();
  const auto way = std::make_shared<CancelWay>(participant_, names);
  if (!waitUntil(deadlineIn(kMeeting_s), [&] { return way->heardBy() > 0; })) {
    throw std::runtime_error(action + " of ROS 2 does not answer, so its goals cannot be canceled");
  }
  return way;
}

std::shared_ptr<StopWay> Ros2Stops::messageWay(const GuardOutput& output,
                                               const std::vector<DdsEndpoint>& all) {
  const std::string topic = replay::ddsTopicName(output.topic);
  const std::vector<DdsEndpoint> readers = endpointsOf(all, topic, false);
  if (readers.empty()) return std::make_shared<NoWay>();
  const DdsEndpoint& first = readers.front();
  const auto type = replay::typeOfDds(first.type);
  for (const DdsEndpoint& reader : readers) {
    const bool is_possible =
        type && reader.type == first.type && replay::MessageToRos2::isPossible(output.type, *type);
    if (is_possible) continue;
    throw std::runtime_error("a node of ROS 2 hears " + output.topic + " as " + reader.type +
                             ", for which no stop is known");
  }
  const replay::MessageToRos2 conversion({output.topic, *type, definitionOf(*type, first)},
                                         output.type, {output.definition, output.md5sum});
  const auto way = std::make_shared<MessageWay>(participant_, output, first, conversion);
  const bool are_met = waitUntil(deadlineIn(kMeeting_s), [&] {
    return std::all_of(readers.begin(), readers.end(),
                       [&](const DdsEndpoint& reader) { return way->hasMet(reader); });
  });
  if (!are_met) {
    throw std::runtime_error("a node of ROS 2 hears " + output.topic + ", and is not met");
  }
  if (!endpointsOf(all, topic, true).empty()) {
    waitUntil(deadlineIn(kDriverPeriod_s), [&] { return !way->objection().empty(); });
  }
  return way;
}

/// Until its node has answered, or is taken to be one that does not.
std::string Ros2Stops::definitionOf(const std::string& type, const DdsEndpoint& reader) {
  for (;;) {
    if (const auto told = types_.find(type, reader, participant_.endpoints())) return *told;
    std::this_thread::sleep_for(kTypeLook);
  }
}

std::unique_ptr<DdsReader> hearBeats(DdsParticipant& participant, const std::string& topic,
                                     std::function<void(const GuardBeat&)> take) {
  namespace traits = ros::message_traits;
  const std::string type = "afterglow/msg/GuardBeat";
  const replay::FindDefinition find = [](const std::string&) {
    return std::optional(replay::Definition{traits::Definition<GuardBeat>::value(),
                                            traits::MD5Sum<GuardBeat>::value()});
  };
  const replay::Ros2Description description{topic, type, "cdr", "", "", ""};
  replay::Ros2Topic conversion(description, find, replay::Ros2Topic::Source::Robot);
  // A beat that is lost is not waited for: the next one is on its way.
  DdsQos quality{false, false, 100};
  quality.is_carried = true;
  return std::make_unique<DdsReader>(
      participant, replay::ddsTopicName(topic), replay::ddsTypeName(type), quality,
      [conversion = std::move(conversion), take = std::move(take)](DdsSample&& sample) mutable {
        try {
          replay::Bytes bytes = conversion.toRos1(sample.cdr);
          ros::serialization::IStream stream(bytes.data(),
                                             static_cast<std::uint32_t>(bytes.size()));
          GuardBeat beat;
          ros::serialization::deserialize(stream, beat);
          take(beat);
        } catch (const std::exception& error) {
          ROS_WARN_STREAM_THROTTLE(10, "no heartbeat: " << error.what());
        }
      });
}

}  // namespace afterglow::nodes
