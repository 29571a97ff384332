#include "replay/store/behavior_edit.hpp"

#include <algorithm>
#include <map>
#include <tuple>
#include <utility>

#include "replay/messages/foreign_json.hpp"

namespace afterglow::replay {
namespace {

std::string named(const Behavior& behavior) { return "behavior " + std::to_string(behavior.id); }

std::string dump(const nlohmann::json& json) {
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

nlohmann::json snapshotOf(const Behavior& behavior) {
  auto json = parseForeignJson(behavior.snapshot);
  if (!json.is_object()) throw StoreError(named(behavior) + ": its snapshot is no JSON object");
  return json;
}

void changeTags(Behavior& behavior, const BehaviorEdit& edit) {
  std::vector<std::string>& tags = behavior.tags;
  const auto has = [&](const std::string& tag) {
    return std::find(tags.begin(), tags.end(), tag) != tags.end();
  };
  for (const std::string& tag : edit.remove_tags) {
    if (!has(tag)) throw StoreError(named(behavior) + " has no tag \"" + tag + "\"");
    tags.erase(std::remove(tags.begin(), tags.end(), tag), tags.end());
  }
  for (const std::string& tag : edit.add_tags) {
    if (tag.empty()) throw StoreError("an empty tag finds nothing");
    if (!has(tag)) tags.push_back(tag);
  }
}

void addNotes(Behavior& behavior, const std::vector<std::string>& notes) {
  if (notes.empty()) return;
  auto json = snapshotOf(behavior);
  std::vector<std::string> all = notesOf(behavior);
  all.insert(all.end(), notes.begin(), notes.end());
  json["notes"] = all;
  behavior.snapshot = dump(json);
}

/// The part that is to stay.
std::pair<Stamp, Stamp> trimmed(const Behavior& behavior, const BehaviorEdit& edit) {
  const std::int64_t length = behavior.end->ns - behavior.begin.ns;
  const std::int64_t from = edit.from_ns.value_or(0), to = edit.to_ns.value_or(length);
  if (!(0 <= from && from < to && to <= length)) {
    throw StoreError(named(behavior) + " is " + std::to_string(length / 1000000) +
                     " ms long: the part that stays has to begin and end within, in this order");
  }
  return {Stamp{behavior.begin.ns + from}, Stamp{behavior.begin.ns + to}};
}

/// A copy has a sequence of its own, as a server knows a message of a recording by that alone: other
/// than the original's, and than that of a copy which another behavior's trim made of it.
std::uint64_t sequenceOfCopy(const Message& original, const Behavior& behavior) {
  const auto copier = static_cast<std::uint64_t>(behavior.id % 0x7fff);
  return original.sequence + ((copier + 1) << 48);
}

/// Returns for each latched channel that says nothing at `begin` itself the last message before it,
/// stamped with it.
std::vector<Message> latchedInForce(const Store& store, const Behavior& behavior, Stamp begin) {
  MessageRange before;
  before.with_all_topics = true;
  before.end = Stamp{begin.ns + 1};
  std::map<std::int64_t, bool> is_latched;
  std::map<std::int64_t, Message> last;
  const auto cursor = store.messages(behavior, before);
  while (auto message = cursor->next()) {
    const auto [known, is_new] = is_latched.emplace(message->channel, false);
    if (is_new) known->second = store.channel(message->channel).latching;
    if (!known->second) continue;
    if (message->received < begin) {
      last[message->channel] = std::move(*message);
    } else {
      last.erase(message->channel);
    }
  }
  std::vector<Message> messages;
  for (auto& [channel, message] : last) {
    message.received = begin;
    message.sequence = sequenceOfCopy(message, behavior);
    messages.push_back(std::move(message));
  }
  return messages;
}

/// Removes messages: those that no behavior covers can only be removed with one, so a passing one
/// covers them.
void removeMessages(Store& store, const Behavior& behavior, Stamp begin, Stamp end) {
  if (!(begin < end)) return;
  Behavior passing;
  passing.recording = behavior.recording;
  passing.name = behavior.name;
  passing.outcome = behavior.outcome;
  passing.begin = begin;
  passing.end = end;
  store.removeBehavior(store.addBehavior(passing));
}

void trim(Store& store, Behavior& behavior, const BehaviorEdit& edit) {
  const Behavior before = behavior;
  std::tie(behavior.begin, behavior.end) = trimmed(before, edit);
  auto json = snapshotOf(behavior);
  const auto frames = json.find("frames");  // of moments that are no longer its begin and end
  if (frames != json.end() && frames->is_object()) {
    if (behavior.begin != before.begin) frames->erase("begin");
    if (*behavior.end != *before.end) frames->erase("end");
    behavior.snapshot = dump(json);
  }
  behavior.wall_begin.ns += behavior.begin.ns - before.begin.ns;
  if (before.begin < behavior.begin) {
    store.append(latchedInForce(store, before, behavior.begin));
  }
  store.updateBehavior(behavior);
  removeMessages(store, behavior, before.begin, behavior.begin);
  removeMessages(store, behavior, *behavior.end, *before.end);
}

}  // namespace

std::vector<std::string> notesOf(const Behavior& behavior) {
  const auto json = parseForeignJson(behavior.snapshot);
  std::vector<std::string> notes;
  if (!json.is_object() || !json.contains("notes") || !json["notes"].is_array()) return notes;
  for (const auto& note : json["notes"]) {
    if (note.is_string()) notes.push_back(note.get<std::string>());
  }
  return notes;
}

void requireEnded(const Behavior& behavior) {
  if (behavior.end) return;
  throw StoreError(named(behavior) +
                   " has no end: it is being recorded (or its recorder died; the next one ends it)");
}

Behavior editBehavior(Store& store, std::int64_t id, const BehaviorEdit& edit) {
  Behavior behavior;
  store.transaction([&] {
    const auto found = store.behavior(id);
    if (!found) throw StoreError("there is no behavior " + std::to_string(id));
    behavior = *found;
    requireEnded(behavior);
    if (edit.name && edit.name->empty()) {
      throw StoreError("an empty name: a behavior is found by its name");
    }
    behavior.name = edit.name.value_or(behavior.name);
    behavior.outcome = edit.outcome.value_or(behavior.outcome);
    changeTags(behavior, edit);
    addNotes(behavior, edit.notes);
    if (edit.isTrim()) {
      trim(store, behavior, edit);
    } else {
      store.updateBehavior(behavior);
    }
  });
  return behavior;
}

namespace {

bool isKept(const Behavior& behavior, const RetentionPolicy& policy) {
  const auto hasTag = [&](const std::string& tag) {
    return std::find(behavior.tags.begin(), behavior.tags.end(), tag) != behavior.tags.end();
  };
  return isOpen(behavior) || std::any_of(policy.keep_tags.begin(), policy.keep_tags.end(), hasTag);
}

bool isTooOld(const Behavior& behavior, const RetentionPolicy& policy) {
  return policy.ended_before && behavior.end.value_or(behavior.begin) < *policy.ended_before;
}

bool isTooLarge(const Store& store, const RetentionPolicy& policy) {
  if (!policy.most_bytes) return false;
  const auto used = store.usedBytes();
  if (!used) throw StoreError("the store does not know its size: nothing can be removed by size");
  return *used > *policy.most_bytes;
}

/// Thrown to undo a transaction.
struct Undo {};

}  // namespace

std::vector<Behavior> prune(Store& store, const RetentionPolicy& policy,
                            const std::function<void(const Behavior&)>& removed) {
  store.dropUnfinished();
  std::vector<Behavior> oldest_first = store.behaviors({});
  std::reverse(oldest_first.begin(), oldest_first.end());
  std::vector<Behavior> gone;
  bool is_too_large = isTooLarge(store, policy);
  for (Behavior& behavior : oldest_first) {
    if (isKept(behavior, policy)) continue;
    if (!is_too_large && !isTooOld(behavior, policy)) continue;
    store.removeBehavior(behavior.id);
    if (removed) removed(behavior);
    gone.push_back(std::move(behavior));
    is_too_large = is_too_large && isTooLarge(store, policy);
  }
  return gone;
}

std::vector<Behavior> pruneWould(Store& store, const RetentionPolicy& policy) {
  std::vector<Behavior> gone;
  if (!policy.most_bytes) {  // age alone: nothing has to be tried, and nobody waits for it
    gone = store.behaviors({});
    const auto stays = [&](const Behavior& behavior) {
      return isKept(behavior, policy) || !isTooOld(behavior, policy);
    };
    gone.erase(std::remove_if(gone.begin(), gone.end(), stays), gone.end());
    std::reverse(gone.begin(), gone.end());
    return gone;
  }
  try {
    store.transaction([&] {
      gone = prune(store, policy);
      throw Undo{};
    });
  } catch (const Undo&) {
    // The store is as it was.
  }
  return gone;
}

}  // namespace afterglow::replay
