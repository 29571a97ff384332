#include "replay/record/running_behavior.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "replay/record/answer_topic.hpp"

namespace afterglow::replay {
namespace {

/// A clock that is set all the time does not fill the memory.
constexpr std::size_t kMostRemarks = 100;
/// Nor do messages that name other files all the time; each is looked for at the end.
constexpr std::size_t kMostReferences = 1000;

std::string counted(std::uint64_t count, const std::string& topic) {
  return std::to_string(count) + (count == 1 ? " message on " : " messages on ") + topic +
         (count == 1 ? " was" : " were");
}

}  // namespace

RunningBehavior::RunningBehavior(Behavior behavior, const std::vector<TopicLimit>& limits)
    : behavior_(std::move(behavior)), topics_(behavior_.topics.begin(), behavior_.topics.end()) {
  for (const std::string& topic : topics_) {
    if (const auto answer = answerTopic(topic)) answers_.insert(*answer);
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
  if (const auto answer = answerTopic(topic)) answers_.insert(*answer);
  return true;
}

bool RunningBehavior::keeps(const std::string& topic, Stamp received) {
  const auto thinner = thinners_.find(topic);
  return thinner == thinners_.end() || thinner->second.keeps(received);
}

void RunningBehavior::countStored(const std::string& topic) {
  if (isOwn(topic)) {
    ++stored_;
    heard_.insert(topic);
  }
}

void RunningBehavior::countDropped(const std::string& topic) {
  ++dropped_[topic];
  heard_.insert(topic);
}

void RunningBehavior::countRefused(const std::string& topic, const std::string& why) {
  ++refused_[topic];
  why_refused_ = why;
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
  for (const auto& [topic, count] : dropped_) {
    all.push_back(counted(count, topic) + " dropped: " + why_dropped_);
  }
  for (const auto& [topic, count] : refused_) {
    all.push_back(counted(count, topic) + " left out: " + why_refused_);
  }
  for (const auto& [topic, count] : unfit_) {
    all.push_back(counted(count, topic) + " not of its type by the bytes, and kept as it came");
  }
  if (unkept_references_ > 0) {
    all.push_back("more than " + std::to_string(kMostReferences) +
                  " files were referred to; the others were not kept");
  }
  for (const auto& [topic, thinner] : thinners_) {
    if (thinner.leftOut() > 0) {
      all.push_back(counted(thinner.leftOut(), topic) + " left out of " +
                    std::to_string(thinner.seen()) + ", as asked: " + thinner.limit().str());
    }
  }
  return all;
}

RecordedCounts RunningBehavior::counts() const {
  RecordedCounts counts;
  counts.stored = stored_;
  for (const auto& [topic, count] : dropped_) {
    counts.dropped += count;
  }
  for (const auto& [topic, count] : refused_) {
    counts.dropped += count;
  }
  std::set_difference(topics_.begin(), topics_.end(), heard_.begin(), heard_.end(),
                      std::back_inserter(counts.silent_topics));
  counts.remarks = remarks();
  return counts;
}

}  // namespace afterglow::replay
