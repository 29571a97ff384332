/// \file
/// A recorder's store on a MongoDB server that may be slow, or away, also at the start: every write
/// is on this machine's disk when its method returns (Spool), and a thread sends it on, in order
/// and again until the server has confirmed it (SpoolSender). What is left when the recorder ends
/// is sent when the next one starts; so is what the server refuses, which holds up nothing. Nothing is lost, and since everything carries a key of its
/// own, nothing is there twice.
#pragma once

#include <chrono>
#include <string>

#include "replay/store/mongo/spool.hpp"
#include "replay/store/mongo/spool_sender.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {

struct SpoolOptions {
  /// The spool's file; empty: spool-HASH.db, HASH being that of the URI, in $AFTERGLOW_SPOOL or
  /// ~/.local/share/afterglow.
  std::string path;
  std::uint64_t most_bytes = 20'000'000'000;  ///< that may wait; beyond it writing fails, loudly
  /// So long does the end wait until all is sent.
  std::chrono::milliseconds farewell{2000};
  /// Between two attempts; twice as long each time, up to 32 times.
  std::chrono::milliseconds pause{100};
};

/// Ids: recordings and channels have the spool's own, good for this store object only. Behaviors
/// have the server's, of which the spool keeps a reserve; one that never reached the server draws
/// from 2^40 up.
/// Reading: behavior() and behaviorOfKey() know unsent behaviors, too; everything else is the
/// server's answer and fails while it is away.
class SpooledStore final : public Store {
 public:
  SpooledStore(const std::string& uri, const SpoolOptions& options);

  std::int64_t addRecording(const Recording& recording) override;
  /// Imports are not for a recorder's store: these throw, but for the last.
  std::int64_t beginImport(const Recording& recording) override;
  void finishImport(std::int64_t recording) override;
  void dropRecording(std::int64_t recording) override;
  std::size_t dropUnfinished() override;
  std::int64_t addChannel(std::int64_t recording, const Channel& channel) override;
  /// A batch that was sent before is recognized by the server, whatever `duplicates` says.
  void append(const std::vector<Message>& messages,
              Duplicates duplicates = Duplicates::Refuse) override;
  std::int64_t addBehavior(const Behavior& behavior) override;
  void updateBehavior(const Behavior& behavior) override;
  void removeBehavior(std::int64_t id) override;
  void addFile(const std::string& sha256, const Bytes& contents) override;
  void transaction(const std::function<void()>& work) override;

  std::vector<Recording> recordings() const override;
  std::vector<Behavior> behaviors(const BehaviorFilter& filter) const override;
  std::vector<std::string> explain(const BehaviorFilter& filter) const override;
  std::optional<Behavior> behavior(std::int64_t id) const override;
  std::optional<Behavior> behaviorOfKey(const std::string& key) const override;
  std::vector<TopicSummary> topics(const Behavior& behavior) const override;
  std::vector<TopicSummary> contextTopics(const Behavior& behavior) const override;
  Channel channel(std::int64_t id) const override;
  std::unique_ptr<MessageCursor> messages(const Behavior& behavior,
                                          const MessageRange& range) const override;
  std::optional<Bytes> file(const std::string& sha256) const override;

  std::string folder() const override;
  std::optional<SpoolStatus> spoolStatus() const override;
  std::optional<SpoolStatus> sendRest() override;

 private:
  Behavior asOnServer(const Behavior& behavior) const;
  void requireBehavior(std::int64_t id) const;

  const std::string path_;  ///< the spool's
  Spool spool_;
  SpoolSender sender_;  ///< last: its thread uses the spool
};

}  // namespace afterglow::replay
