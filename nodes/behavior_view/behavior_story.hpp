/// \file
/// A recorded behavior for people: its summary, and its story in words, made from what was
/// recorded.
///
/// The messages of a behavior over its time, topic by topic, and its goals.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "replay/ask/said.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

/// A goal of an action, from being sent to its result.
struct GoalSpan {
  std::string topic;         ///< the goal's
  double from = 0;           ///< seconds since the behavior's begin
  std::optional<double> to;  ///< empty: no result was recorded
  std::string outcome;       ///< "succeeded", "aborted" ...; empty without a result
  std::string remark;        ///< words of its server, a line
  std::string within;        ///< the action of a longer goal around it, which may have sent it
  int number = 1;            ///< counted from 1 on its topic
};

struct TopicLane {
  std::string topic, type;
  std::uint64_t count = 0;
  std::optional<double> hz;    ///< empty for a single message
  double first = 0, last = 0;  ///< seconds since the behavior's begin, as all times here
  /// "body", "ar", "speech"; "control", "endless" motion; "state", "other".
  std::string role;
  bool is_context = false;    ///< true: the recording's, not the behavior's own
  std::string why_not;        ///< reason for a replay to leave it out; empty: it is replayed
  std::vector<double> marks;  ///< times of messages; of many some
  std::vector<GoalSpan> spans;
};

constexpr std::size_t kMostMarks = 400;

/// Own topics first, then the context's. Reads a bounded number of messages, however many there
/// are: of topics with many the first after each of 100 moments. Throws replay::StoreError.
std::vector<TopicLane> topicLanes(const replay::Store& store, const replay::Behavior& behavior);

/// Returns the name of an action by the topic of its goals:
/// "arm_controller/follow_joint_trajectory".
std::string actionName(const std::string& goal_topic);

/// Returns the begin as people saw it: ROS time may be a simulation's.
replay::Stamp wallBegin(const replay::Behavior& behavior);

struct BehaviorSummary {
  replay::Behavior behavior;  ///< the behavior, without calibration and snapshot
  std::vector<std::string> notes;
  std::uint64_t messages = 0;  ///< messages on its own topics
  replay::Stamp end;           ///< its end, or the last message
  std::vector<replay::Utterance> said;
};

/// Returns the part of a summary that needs no messages.
BehaviorSummary summaryOf(const replay::Behavior& behavior);
/// Adds the part that messages tell. Throws replay::StoreError.
void addMessages(const replay::Store& store, BehaviorSummary& summary);

/// Shared with the console's index, which replaces them when they change.
using BehaviorSummaries = std::vector<std::shared_ptr<const BehaviorSummary>>;

struct StoryEntry {
  double t = 0;               ///< seconds since the behavior's begin
  std::string clock;          ///< "12:03:20", local time
  std::string kind;           ///< "began", "said", "goal", "child", "ended", "remark"
  std::string text;           ///< a sentence
  std::string subject;        ///< the text without times and numbers: what two stories share
  std::int64_t behavior = 0;  ///< the child's
  bool is_bad = false;        ///< a failure
};

struct ToldStory {
  std::vector<StoryEntry> entries;  ///< entries in their order
  std::vector<double> key_moments;  ///< moments that pictures should show, 6 at most
};

/// All that a page shows of one behavior.
struct BehaviorDetail {
  std::shared_ptr<const BehaviorSummary> summary;
  replay::Behavior behavior;  ///< whole
  std::vector<TopicLane> lanes;
  ToldStory story;
  BehaviorSummaries children;  ///< newest first
  BehaviorSummaries attempts;  ///< others of this name and tree path under the same parent
};

bool isAttemptOf(const replay::Behavior& other, const replay::Behavior& behavior);
/// Adds lanes and story to the behavior, its summary and its children. Throws replay::StoreError.
void addStory(const replay::Store& store, BehaviorDetail& detail);
/// Reads a behavior with its children from the store alone. Throws replay::StoreError.
BehaviorDetail readDetail(const replay::Store& store, const replay::Behavior& behavior);

/// A line of two stories side by side; empty: that story has nothing like it.
struct StoryPair {
  std::optional<std::size_t> a, b;  ///< indexes into the two stories
};

/// Pairs by the longest sequence of subjects that both have (LCS), of each story at most 300
/// entries.
std::vector<StoryPair> pairStories(const std::vector<StoryEntry>& a,
                                   const std::vector<StoryEntry>& b);

}  // namespace afterglow::nodes
