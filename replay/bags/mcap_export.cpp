#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "replay/bags/bag_file.hpp"
#include "replay/bags/export_file.hpp"
#include "replay/bags/mcap_writer.hpp"

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

class McapExport : public ExportFile {
 public:
  McapExport(const std::string& path, Packing packing, const std::vector<Behavior>& behaviors)
      : ExportFile(path), writer_(partial(), path, "ros1", packing) {
    for (const Behavior& behavior : behaviors) {
      writer_.addMetadata("afterglow/behavior", describe(behavior));
    }
  }

  void write(const Message& message, const Channel& channel) override {
    if (message.received.ns < 0) {
      throw BagError(path() + ": an MCAP file cannot hold the stamp " +
                     std::to_string(message.received.ns) + " ns");
    }
    writer_.write(channelOf(message, channel), static_cast<std::uint32_t>(message.sequence),
                  static_cast<std::uint64_t>(message.received.ns), message.bytes);
  }

  std::uint64_t size() const override { return writer_.size(); }
  void close() override { writer_.close(); }

 private:
  std::uint16_t channelOf(const Message& message, const Channel& channel) {
    const auto known = channels_.find(message.channel);
    if (known != channels_.end()) return known->second;
    const auto [schema, is_new] =
        schemas_.try_emplace(std::pair(channel.type, channel.definition), 0);
    if (is_new) {
      schema->second = writer_.addSchema({channel.type, "ros1msg", channel.definition});
    }
    // Named as a connection header's fields.
    McapChannel added{schema->second, channel.topic, "ros1", {{"md5sum", channel.md5}}};
    if (channel.latching) added.metadata["latching"] = "1";
    if (!channel.caller_id.empty()) added.metadata["callerid"] = channel.caller_id;
    return channels_[message.channel] = writer_.addChannel(added);
  }

  McapWriter writer_;
  /// Ids by type, definition.
  std::map<std::pair<std::string, std::string>, std::uint16_t> schemas_;
  std::map<std::int64_t, std::uint16_t> channels_;  ///< ids by the store's channel
};

}  // namespace

std::unique_ptr<ExportFile> writeMcap(const std::string& path, Packing packing,
                                      const std::vector<Behavior>& behaviors) {
  return std::make_unique<McapExport>(path, packing, behaviors);
}

}  // namespace afterglow::replay
