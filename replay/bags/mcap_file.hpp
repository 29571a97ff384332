/// \file
/// MCAP files of ROS 1 and ROS 2. Internal to replay.
#pragma once

#include "replay/bags/mcap_reader.hpp"
#include "replay/bags/recorded_file.hpp"
#include "replay/bags/topic_intake.hpp"

namespace afterglow::replay {

/// Messages of ROS 1 are taken byte by byte, those of ROS 2 become those of ROS 1; others are left
/// out.
class McapFile : public RecordedFile {
 public:
  McapFile(const std::string& path, FindDefinition find)
      : reader_(path), intake_(std::move(find)) {}

  const std::string& path() const override { return reader_.path(); }
  std::uint64_t total() const override { return reader_.total(); }
  Stamp begin() const override { return {static_cast<std::int64_t>(reader_.begin())}; }
  std::optional<Item> next() override;
  const Channel& channel(std::uint32_t id) const override { return intake_.channel(id); }
  std::vector<std::string> remarks() const override { return intake_.remarks(); }
  std::string whyIncomplete() const override { return reader_.whyIncomplete(); }

 private:
  void addTopic(std::uint16_t id);

  McapReader reader_;
  TopicIntake intake_;
};

}  // namespace afterglow::replay
