#include "replay/record/running_behavior.hpp"

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "replay/messages/text.hpp"
#include "replay/messages/topic_name.hpp"

namespace afterglow::replay {
namespace {

/// A clock that is set all the time does not fill the memory.
constexpr std::size_t kMostRemarks = 100;
/// Nor do messages that name other files all the time; each is looked for at the end.
constexpr std::size_t kMostReferences = 1000;

std::string messagesWere(std::uint64_t count, const std::string& topic) {
  return counted(count, "message") + " on " + topic + (count == 1 ? " was" : " were");
}

/// "kitting" contains "kitting/pick", not "kitting2".
bool contains(const std::string& outer, const std::string& inner) {
  return !outer.empty() && inner.size() > outer.size() &&
         inner.compare(0, outer.size(), outer) == 0 && inner[outer.size()] == '/';
}

}  // namespace

std::vector<std::string> goalTopics(const std::string& topic) {
  const std::string action = actionOfGoal(topic);
  if (action.empty()) return {};
  return {action + "/result", action + "/cancel"};
}

RunningBehavior::RunningBehavior(Behavior behavior, const std::vector<TopicLimit>& limits)
    : behavior_(std::move(behavior)),
      topics_(behavior_.topics.begin(), behavior_.topics.end()),
      last_stored_(behavior_.begin) {
  for (const std::string& topic : topics_) {
    for (const std::string& answer : goalTopics(topic)) answers_.insert(answer);
  }
  for (const TopicLimit& limit : limits) {
    thinners_.emplace(limit.topic, TopicThinner(limit));
  }
}

Behavior RunningBehavior::written() const {
  Behavior behavior = behavior_;
  behavior.remarks = remarks();
  return behavior;
}

bool RunningBehavior::addTopic(const std::string& topic) {
  if (!topics_.insert(topic).second) {
    return false;
  }
  behavior_.topics.push_back(topic);
  for (const std::string& answer : goalTopics(topic)) answers_.insert(answer);
  return true;
}

bool RunningBehavior::keeps(const std::string& topic, Stamp received) {
  const auto thinner = thinners_.find(topic);
  return thinner == thinners_.end() || thinner->second.keeps(received);
}

void RunningBehavior::countStored(const std::string& topic, Stamp received) {
  last_stored_ = std::max(last_stored_, received);
  if (isOwn(topic)) {
    ++stored_;
    ++stored_on_[topic];
    heard_.insert(topic);
  }
}

void RunningBehavior::countDropped(const std::string& topic, const std::string& why) {
  Dropped& dropped = dropped_[topic];
  ++dropped.count;
  dropped.why = why;
  heard_.insert(topic);
}

void RunningBehavior::countRefused(const std::string& topic, const std::string& why) {
  Dropped& refused = refused_[topic];
  ++refused.count;
  refused.why = why;
  heard_.insert(topic);
}

void RunningBehavior::refer(const std::string& uri) {
  if (references_.size() < kMostReferences) {
    references_.insert(uri);
  } else if (references_.count(uri) == 0) {
    ++unkept_references_;
  }
}

void RunningBehavior::remark(const std::string& text) {
  if (remarks_.size() < kMostRemarks) {
    remarks_.push_back(text);
  }
}

std::vector<std::string> RunningBehavior::remarks() const {
  std::vector<std::string> all = remarks_;
  for (const auto& [topic, dropped] : dropped_) {
    all.push_back(messagesWere(dropped.count, topic) + " dropped: " + dropped.why);
  }
  for (const auto& [topic, refused] : refused_) {
    all.push_back(messagesWere(refused.count, topic) + " left out: " + refused.why);
  }
  for (const auto& [topic, count] : unfit_) {
    all.push_back(messagesWere(count, topic) +
                  " not of its type by the bytes, and kept as it came");
  }
  if (unkept_references_ > 0) {
    all.push_back("more than " + std::to_string(kMostReferences) +
                  " files were referred to; the others were not kept");
  }
  for (const auto& [topic, thinner] : thinners_) {
    if (thinner.leftOut() > 0) {
      all.push_back(messagesWere(thinner.leftOut(), topic) + " left out of " +
                    std::to_string(thinner.seen()) + ", as asked: " + thinner.limit().str());
    }
  }
  return all;
}

RecordedCounts RunningBehavior::counts() const {
  RecordedCounts counts;
  counts.stored = stored_;
  counts.stored_on = stored_on_;
  for (const auto& [topic, dropped] : dropped_) counts.dropped += dropped.count;
  for (const auto& [topic, refused] : refused_) counts.dropped += refused.count;
  std::set_difference(topics_.begin(), topics_.end(), heard_.begin(), heard_.end(),
                      std::back_inserter(counts.silent_topics));
  counts.remarks = remarks();
  return counts;
}

// ------------------------------------------------------------------------------ RunningBehaviors

std::int64_t RunningBehaviors::add(Behavior& behavior, const std::vector<TopicLimit>& limits) {
  if (behavior.parent == 0) behavior.parent = enclosing(behavior.tree_path);
  if (behavior.attempt == 0) behavior.attempt = nextAttempt(behavior);
  const std::int64_t provisional = -++added_;
  by_id_.emplace(provisional, RunningBehavior(behavior, limits));
  return provisional;
}

std::int64_t RunningBehaviors::enclosing(const std::string& tree_path) const {
  const Behavior* deepest = nullptr;
  for (const auto& [id, running] : by_id_) {
    const Behavior& candidate = running.behavior();
    if (id > 0 && contains(candidate.tree_path, tree_path) &&
        (!deepest || candidate.tree_path.size() >= deepest->tree_path.size())) {
      deepest = &candidate;
    }
  }
  return deepest ? deepest->id : 0;
}

int RunningBehaviors::nextAttempt(const Behavior& behavior) {
  if (behavior.parent == 0 && behavior.tree_path.empty()) return 1;
  return ++attempts_[{behavior.parent, behavior.tree_path, behavior.name}];
}

void RunningBehaviors::rename(std::int64_t provisional, std::int64_t id) {
  auto node = by_id_.extract(provisional);
  node.key() = id;
  node.mapped().setId(id);
  by_id_.insert(std::move(node));
}

void RunningBehaviors::remove(std::int64_t id) {
  by_id_.erase(id);
  const auto first = attempts_.lower_bound({id, "", ""});
  attempts_.erase(first, attempts_.lower_bound({id + 1, "", ""}));
}

RunningBehavior& RunningBehaviors::at(std::int64_t id) {
  const auto found = by_id_.find(id);
  if (found == by_id_.end()) {
    throw std::logic_error("behavior " + std::to_string(id) + " is not being recorded");
  }
  return found->second;
}

const RunningBehavior* RunningBehaviors::find(std::int64_t id) const {
  const auto found = by_id_.find(id);
  return found == by_id_.end() ? nullptr : &found->second;
}

RunningBehaviors::Want RunningBehaviors::wants(const std::string& topic, Stamp received) {
  Want want = Want::No;
  forCovering(topic, received, [&](RunningBehavior& running) {
    want = running.keeps(topic, received) || want == Want::Yes ? Want::Yes : Want::LeftOut;
  });
  return want;
}

void RunningBehaviors::remark(const std::string& text) {
  for (auto& [id, running] : by_id_) running.remark(text);
}

std::set<std::string> RunningBehaviors::topicsOf(const RunningBehavior& running) const {
  std::set<std::string> topics = context_;
  topics.insert(running.behavior().topics.begin(), running.behavior().topics.end());
  topics.insert(running.answers().begin(), running.answers().end());
  return topics;
}

bool RunningBehaviors::covers(const RunningBehavior& running, const std::string& topic,
                              Stamp received) const {
  return running.isWithin(received) && (running.isOwn(topic) || context_.count(topic) != 0 ||
                                        running.answers().count(topic) != 0);
}

}  // namespace afterglow::replay
