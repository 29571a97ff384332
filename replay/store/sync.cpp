#include "replay/store/sync.hpp"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "replay/messages/foreign_json.hpp"
#include "replay/store/store_import.hpp"

namespace afterglow::replay {
namespace {

class Sync {
 public:
  Sync(const Store& from, Store& to, const SyncTerms& terms, const SyncProgress& progress)
      : from_(from), to_(to), terms_(terms), progress_(progress) {
    for (const Recording& recording : from.recordings()) recordings_[recording.id] = recording;
  }

  SyncReport run(const std::vector<Behavior>& behaviors) {
    all_ = behaviors.size();
    for (; done_ < all_; ++done_) {
      tell();
      copy(behaviors[done_]);
    }
    tell();
    return report_;
  }

 private:
  void tell() const {
    if (progress_) progress_(done_, all_, report_);
  }

  void copy(Behavior behavior) {
    if (isOpen(behavior)) {
      ++report_.open;
      return;
    }
    behavior.parent = parentThere(behavior.parent);
    const auto there = to_.behaviorOfKey(behavior.key);
    const bool lacks_end = there && !there->end;
    const bool lacks_parent = there && there->parent == 0 && behavior.parent != 0;
    const bool lacks_messages =
        there && terms_.is_sending && messagesOf(to_, *there) < messagesOf(from_, behavior);
    if (there && !lacks_end && !lacks_parent && !lacks_messages) {
      ++report_.present;
      return;
    }
    if (!there || lacks_end || lacks_messages) copyContents(behavior);
    if (!there) {
      if (!terms_.is_sending) behavior.id = 0;
      behavior.recording = recordingThere(behavior.recording);
      to_.addBehavior(behavior);
      ++report_.copied;
      return;
    }
    Behavior completed = *there;
    completed.parent = lacks_parent ? behavior.parent : there->parent;
    if (lacks_end) {
      completed.end = behavior.end;
      completed.outcome = behavior.outcome;
      completed.remarks = behavior.remarks;
      completed.snapshot = behavior.snapshot;
    }
    to_.updateBehavior(completed);
    ++report_.completed;
  }

  static std::uint64_t messagesOf(const Store& store, const Behavior& behavior) {
    std::uint64_t count = 0;
    for (const TopicSummary& topic : store.topics(behavior)) count += topic.count;
    for (const TopicSummary& topic : store.contextTopics(behavior)) count += topic.count;
    return count;
  }

  std::int64_t parentThere(std::int64_t id) const {
    const auto parent = id != 0 ? from_.behavior(id) : std::nullopt;
    const auto there = parent ? to_.behaviorOfKey(parent->key) : std::nullopt;
    return there ? there->id : 0;
  }

  std::int64_t recordingThere(std::int64_t id) {
    const auto known = recordings_there_.find(id);
    if (known != recordings_there_.end()) return known->second;
    const auto recording = recordings_.find(id);
    if (recording == recordings_.end()) {
      throw StoreError("recording " + std::to_string(id) + " is missing in the store");
    }
    return recordings_there_[id] = to_.addRecording(recording->second);
  }

  std::int64_t channelThere(std::int64_t recording, std::int64_t id) {
    const auto known = channels_there_.find(id);
    if (known != channels_there_.end()) return known->second;
    return channels_there_[id] = to_.addChannel(recordingThere(recording), from_.channel(id));
  }

  /// Copies messages and files. A behavior whose recorder died gets its end here, behind the last
  /// message.
  void copyContents(Behavior& behavior) {
    Behavior before = behavior;
    before.begin.ns -= kTransformsBefore_ns;
    before.end = behavior.begin;
    MessageRange transforms;
    transforms.topics = {kTransforms};
    const std::uint64_t counted = report_.messages;
    copyMessages(before, transforms);
    report_.messages = counted;  // those of an earlier behavior are there already
    MessageRange all;
    all.with_all_topics = true;
    const Stamp last = copyMessages(behavior, all);
    if (!behavior.end) behavior.end = Stamp{last.ns + 1};
    copyFiles(behavior);
  }

  /// Returns the last one's stamp; without any, that of the begin.
  Stamp copyMessages(const Behavior& behavior, const MessageRange& range) {
    const auto cursor = from_.messages(behavior, range);
    Stamp last = behavior.begin;
    const auto appended = [&, before = report_.messages](std::uint64_t done) {
      report_.messages = before + done;
      tell();
    };
    AppendBatch batch(to_, appended, Duplicates::Skip);
    while (auto message = cursor->next()) {
      last = message->received;
      if (terms_.leaves_out_refused) {
        append(behavior.recording, std::move(*message));
        continue;
      }
      message->channel = channelThere(behavior.recording, message->channel);
      batch.add(std::move(*message));
    }
    if (!terms_.leaves_out_refused) batch.flush();
    report_.damaged += cursor->damaged().size();
    return last;
  }

  /// Appends one by one, as else nobody knows which message it is that is refused.
  void append(std::int64_t recording, Message&& message) {
    const std::int64_t channel = message.channel;
    try {
      message.channel = channelThere(recording, channel);
      to_.append({message}, Duplicates::Skip);
      ++report_.messages;
      tell();
    } catch (const StoreAway&) {
      throw;
    } catch (const StoreBusy&) {
      throw;
    } catch (const StoreError& error) {
      ++report_.refused;
      report_.last_refusal = "a message on " + from_.channel(channel).topic + ": " + error.what();
    }
  }

  void copyFiles(const Behavior& behavior) {
    const auto snapshot = parseForeignJson(behavior.snapshot);
    if (!snapshot.is_object()) return;
    std::vector<nlohmann::json> sums;
    if (snapshot.contains("urdf")) sums.push_back(snapshot["urdf"]);
    if (snapshot.contains("files")) {
      for (const auto& sum : snapshot["files"]) sums.push_back(sum);
    }
    for (const auto& sum : sums) {
      if (!sum.is_string()) continue;
      const auto contents = from_.file(sum.get<std::string>());
      if (!contents) continue;
      to_.addFile(sum.get<std::string>(), *contents);
      ++report_.files;
    }
  }

  const Store& from_;
  Store& to_;
  const SyncTerms terms_;
  const SyncProgress& progress_;
  std::map<std::int64_t, Recording> recordings_;
  std::map<std::int64_t, std::int64_t> recordings_there_, channels_there_;
  std::size_t done_ = 0, all_ = 0;
  SyncReport report_;
};

}  // namespace

SyncReport syncBehaviors(const Store& from, Store& to, const BehaviorFilter& filter,
                         const SyncProgress& progress) {
  std::vector<Behavior> behaviors = from.behaviors(filter);
  std::reverse(behaviors.begin(), behaviors.end());  // parents come before their children
  return syncBehaviors(from, to, behaviors, SyncTerms(), progress);
}

SyncReport syncBehaviors(const Store& from, Store& to, const std::vector<Behavior>& behaviors,
                         const SyncTerms& terms, const SyncProgress& progress) {
  return Sync(from, to, terms, progress).run(behaviors);
}

}  // namespace afterglow::replay
