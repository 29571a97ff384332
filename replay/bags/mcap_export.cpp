#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "replay/bags/bag_file.hpp"
#include "replay/bags/export_file.hpp"
#include "replay/bags/mcap_writer.hpp"
#include "replay/ros2/cdr_conversion.hpp"

namespace afterglow::replay {
namespace {

std::string toJson(const std::vector<std::string>& texts) {
  return nlohmann::json(texts).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

/// Returns what Afterglow knows of a behavior beside its messages.
std::map<std::string, std::string> describe(const Behavior& behavior) {
  std::map<std::string, std::string> entries{
      {"id", std::to_string(behavior.id)},
      {"key", behavior.key},
      {"name", behavior.name},
      {"tree_path", behavior.tree_path},
      {"attempt", std::to_string(behavior.attempt)},
      {"outcome", behavior.outcome},
      {"begin_ns", std::to_string(behavior.begin.ns)},
      {"robot", behavior.robot},
      {"parameters", behavior.parameters},
      {"tags", toJson(behavior.tags)},
      {"calibration", behavior.calibration},
      {"topics", toJson(behavior.topics)},
      {"snapshot", behavior.snapshot},
      {"remarks", toJson(behavior.remarks)}};
  if (behavior.parent != 0) entries["parent"] = std::to_string(behavior.parent);
  if (behavior.end) entries["end_ns"] = std::to_string(behavior.end->ns);
  return entries;
}

/// A publisher's quality of service as rosbag2 writes it: its last message is kept for who comes
/// later. Policies are numbers up to Humble, and still read.
constexpr const char* kLatchedQuality =
    "- history: 1\n  depth: 1\n  reliability: 1\n  durability: 1\n"
    "  deadline:\n    sec: 9223372036\n    nsec: 854775807\n"
    "  lifespan:\n    sec: 9223372036\n    nsec: 854775807\n  liveliness: 1\n"
    "  liveliness_lease_duration:\n    sec: 9223372036\n    nsec: 854775807\n"
    "  avoid_ros_namespace_conventions: false";

class McapExport : public ExportFile {
 public:
  McapExport(const std::string& path, Packing packing, bool is_ros2,
             const std::vector<Behavior>& behaviors)
      : ExportFile(path),
        is_ros2_(is_ros2),
        writer_(partial(), path, is_ros2 ? "ros2" : "ros1", packing) {
    for (const Behavior& behavior : behaviors) {
      writer_.addMetadata("afterglow/behavior", describe(behavior));
    }
  }

  void write(const Message& message, const Channel& channel) override {
    if (message.received.ns < 0) {
      throw BagError(path() + ": an MCAP file cannot hold the stamp " +
                     std::to_string(message.received.ns) + " ns");
    }
    const auto sequence = static_cast<std::uint32_t>(message.sequence);
    const auto time = static_cast<std::uint64_t>(message.received.ns);
    try {
      const Output& output = outputOf(message, channel);
      writer_.write(output.id, sequence, time,
                    output.conversion ? output.conversion->toRos2(message.bytes) : message.bytes);
    } catch (const MessageError& error) {
      throw BagError(path() + ": a message of " + channel.topic +
                     " is none of ROS 2's: " + error.what());
    }
  }

  std::uint64_t size() const override { return writer_.size(); }
  void close() override { writer_.close(); }

 private:
  struct Output {
    std::uint16_t id;
    std::optional<CdrConversion> conversion;  ///< of a message of ROS 2
  };

  const Output& outputOf(const Message& message, const Channel& channel) {
    const auto known = outputs_.find(message.channel);
    if (known != outputs_.end()) return known->second;
    return outputs_.emplace(message.channel, is_ros2_ ? ros2Output(channel) : ros1Output(channel))
        .first->second;
  }

  Output ros1Output(const Channel& channel) {
    // Named as a connection header's fields.
    McapChannel added{schemaOf({channel.type, "ros1msg", channel.definition}),
                      channel.topic,
                      "ros1",
                      {{"md5sum", channel.md5}}};
    if (channel.latching) added.metadata["latching"] = "1";
    if (!channel.caller_id.empty()) added.metadata["callerid"] = channel.caller_id;
    return {writer_.addChannel(added), std::nullopt};
  }

  Output ros2Output(const Channel& channel) {
    const auto layouts = ros2Layouts(channel.type, {channel.definition, channel.md5});
    const std::string& text = layouts.empty() ? channel.definition : layouts.front();
    McapChannel added{
        schemaOf({ros2TypeName(channel.type), "ros2msg", ros2Definition(channel.type, text)}),
        channel.topic,
        "cdr",
        {}};
    if (channel.latching) added.metadata["offered_qos_profiles"] = kLatchedQuality;
    return {writer_.addChannel(added),
            CdrConversion(Schema::parse(channel.type, text), Schema::of(channel))};
  }

  std::uint16_t schemaOf(const McapSchema& schema) {
    const auto [known, is_new] = schemas_.try_emplace(std::pair(schema.name, schema.text), 0);
    if (is_new) known->second = writer_.addSchema(schema);
    return known->second;
  }

  const bool is_ros2_;
  McapWriter writer_;
  /// Ids by type, definition.
  std::map<std::pair<std::string, std::string>, std::uint16_t> schemas_;
  std::map<std::int64_t, Output> outputs_;  ///< outputs by the store's channel
};

}  // namespace

std::unique_ptr<ExportFile> writeMcap(const std::string& path, Packing packing, bool is_ros2,
                                      const std::vector<Behavior>& behaviors) {
  return std::make_unique<McapExport>(path, packing, is_ros2, behaviors);
}

}  // namespace afterglow::replay
