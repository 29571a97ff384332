/// \file
/// DDS as ROS 2 uses it, with messages as bytes: readers and writers of any topic and type, and
/// those of others as they come and go. Fast DDS stays in dds.cpp, which knows its versions.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "replay/messages/message.hpp"
#include "replay/ros2/ros2_graph.hpp"

namespace afterglow::nodes {

/// The name of a reader or a writer that no other has in the network.
struct DdsGuid {
  std::array<std::uint8_t, 16> bytes{};

  bool isKnown() const { return *this != DdsGuid(); }
  bool isOfParticipant(const DdsGuid& other) const;  ///< both are of one participant
  friend bool operator==(const DdsGuid& a, const DdsGuid& b) { return a.bytes == b.bytes; }
  friend bool operator!=(const DdsGuid& a, const DdsGuid& b) { return a.bytes != b.bytes; }
  friend bool operator<(const DdsGuid& a, const DdsGuid& b) { return a.bytes < b.bytes; }
};

/// What a writer offers, or a reader asks for.
struct DdsQos {
  bool is_reliable = true;
  bool is_transient_local = false;  ///< whoever comes late gets the last messages
  std::int32_t depth = 10;          ///< messages that are kept; others do not tell theirs: 0
  /// A writer that has `depth` messages, or 256 MB, that a reliable reader did not acknowledge
  /// gives them all up and counts them (DdsWriter::givenUp()); else the oldest goes, uncounted.
  bool is_counted = false;
  bool is_carried = false;          ///< Afterglow's own, and a bridge carries it as a robot's

  /// Whether and how messages are kept, without the depth.
  std::pair<bool, bool> kind() const { return {is_reliable, is_transient_local}; }
};

/// A reader or a writer of another program.
struct DdsEndpoint {
  DdsGuid guid;
  bool is_writer = false;
  std::string topic, type;  ///< as DDS has them: "rt/chatter", "std_msgs::msg::dds_::String_"
  DdsQos qos;
  std::string type_hash;  ///< "RIHS01_..."; empty: a node before Iron
};

/// A message's place in all that was written.
struct SampleIdentity {
  DdsGuid writer;
  std::int64_t sequence = 0;

  friend bool operator<(const SampleIdentity& a, const SampleIdentity& b) {
    return a.writer == b.writer ? a.sequence < b.sequence : a.writer < b.writer;
  }
};

struct DdsSample {
  DdsGuid writer;
  SampleIdentity identity;
  SampleIdentity related;  ///< a reply's request; a request's reader of replies, without sequence
  replay::Stamp sent;      ///< the writer's clock
  replay::Bytes cdr;       ///< with the encapsulation header's 4 bytes
};

class DdsParticipant {
 public:
  struct Listener {
    /// An endpoint of others came, changed or went.
    std::function<void()> on_change;
    /// A reader or writer of this participant meets one that offers, or asks for, what does not
    /// fit, so that no message passes between the two. `policy`: "reliability", "deadline".
    std::function<void(const std::string& topic, const std::string& policy)> on_misfit;
  };

  /// The listener is called in threads of DDS and must not call DDS. Throws std::runtime_error if
  /// DDS refuses. With this machine alone, participants of others are not looked for, and ignored.
  DdsParticipant(const replay::Ros2Network& network, const std::string& name, Listener listener);
  /// Its readers and writers are gone by then.
  ~DdsParticipant();
  DdsParticipant(const DdsParticipant&) = delete;
  DdsParticipant& operator=(const DdsParticipant&) = delete;

  /// The endpoints of others, by topic and GUID. Those of Afterglow's participants, in whichever
  /// process, are left out, so that what one sends is not taken for a robot's. Any thread.
  std::vector<DdsEndpoint> endpoints() const;
  /// What one of them offers or asks for; empty: there is none of that name. Any thread, those of
  /// DDS, too.
  std::optional<DdsQos> qosOf(const DdsGuid& guid) const;
  DdsGuid guid() const;

 private:
  friend class DdsReader;
  friend class DdsWriter;
  class State;
  std::unique_ptr<State> state_;
};

/// Any thread; destroyed in none of DDS's.
class DdsWriter {
 public:
  /// Throws std::runtime_error, one line, if DDS refuses, as it does for a second type of a topic.
  DdsWriter(DdsParticipant& participant, const std::string& topic, const std::string& type,
            const DdsQos& qos);
  ~DdsWriter();
  DdsWriter(const DdsWriter&) = delete;
  DdsWriter& operator=(const DdsWriter&) = delete;

  /// `related`: a reply's request, or a request's reader of replies. Returns the message's
  /// identity. Sent by the calling thread, but what does not leave within 20 ms. Throws
  /// std::runtime_error if DDS refuses it.
  SampleIdentity write(const replay::Bytes& cdr, const SampleIdentity& related = {});
  std::uint64_t givenUp() const;  ///< messages, if they are counted (DdsQos)
  DdsGuid guid() const;
  /// The readers that get what is written from now on.
  std::vector<DdsGuid> matched() const;

 private:
  class State;
  std::unique_ptr<State> state_;
};

/// Any thread; destroyed in none of DDS's.
class DdsReader {
 public:
  /// Called in a thread of DDS, one message after the other, until the reader is destroyed, which
  /// waits for the call under way. Must not throw.
  using Take = std::function<void(DdsSample&& sample)>;

  /// Throws as DdsWriter.
  DdsReader(DdsParticipant& participant, const std::string& topic, const std::string& type,
            const DdsQos& qos, Take take);
  ~DdsReader();
  DdsReader(const DdsReader&) = delete;
  DdsReader& operator=(const DdsReader&) = delete;

  /// Messages of reliable writers that never came: those gave them up.
  std::uint64_t lost() const;
  DdsGuid guid() const;
  std::vector<DdsGuid> matched() const;  ///< writers

 private:
  class State;
  std::unique_ptr<State> state_;
};

}  // namespace afterglow::nodes
