#include "nodes/player/stagehand.hpp"

#include <std_msgs/String.h>

#include <chrono>
#include <thread>
#include <utility>

namespace afterglow::nodes {
namespace {

bool isAnchored(const replay::PlayPlan& plan, const replay::AnchorSettings& settings) {
  bool is_anchored = false;
  for (const replay::PlannedTopic& topic : plan.topics) {
    if (!topic.isPlayed()) continue;
    if (topic.channel.topic == "/tf") return false;
    is_anchored = is_anchored || settings.of(topic.channel) == replay::Anchor::World;
  }
  return is_anchored;
}

}  // namespace

bool Stagehand::fit(const replay::Store& store, replay::PlayPlan& plan,
                    const replay::AnchorSettings& settings) {
  renewSpeechOutputs(plan);
  return isAnchored(plan, settings) && WorldAnchor::refuseUnplaced(store, plan, settings);
}

Stagehand::Stagehand(const replay::Store& store, const replay::PlayPlan& plan,
                     const replay::AnchorSettings& settings, replay::MessageSink& sink,
                     AnchorBroadcast::Position position)
    : store_(store),
      plan_(plan),
      needs_anchor_([&] {
        replay::PlayPlan asked = plan;
        return fit(store, asked, settings);
      }()),
      media_(store, plan, sink) {
  if (isAnchored(plan, settings)) anchor_.emplace(store, plan, settings, std::move(position));
  for (const replay::PlannedTopic& topic : plan.topics) {
    if (topic.isPlayed() && topic.output.type == "sound_play/SoundRequest") {
      speech_topic_ = topic.output.topic;
    }
  }
  if (speech_topic_.empty()) return;
  node_.setCallbackQueue(&queue_);
  ahead_ = node_.advertise<sound_play::SoundRequest>(speech_topic_ + "/ahead", 100);
  problems_ = node_.subscribe<std_msgs::String>(speech_topic_ + "/problem", 100,
                                                [this](const std_msgs::StringConstPtr& problem) {
                                                  if (!problem->data.empty())
                                                    heard_problems_.insert(problem->data);
                                                });
}

void Stagehand::prepare(const std::function<bool()>& is_stopped) {
  const Deadline deadline = deadlineIn(kMasterPatience);
  if (!speech_topic_.empty()) tellAhead(deadline, is_stopped);
  if (needs_anchor_) anchor_->waitForAnchor(deadline, is_stopped);
}

void Stagehand::tellAhead(Deadline deadline, const std::function<bool()>& is_stopped) {
  const std::size_t expected =
      askMaster(deadlineIn(kMasterPatience)).otherSubscribers(speech_topic_ + "/ahead").size();
  while (ahead_.getNumSubscribers() < expected && !is_stopped() &&
         std::chrono::steady_clock::now() < deadline) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  if (ahead_.getNumSubscribers() == 0) return;
  for (const sound_play::SoundRequest& sentence : sentencesOf(store_, plan_)) {
    ahead_.publish(sentence);
  }
}

std::vector<std::string> Stagehand::notes() {
  queue_.callAvailable();
  std::vector<std::string> notes = media_.notes();
  if (anchor_) {
    const std::vector<std::string> unplaced = anchor_->notes();
    notes.insert(notes.end(), unplaced.begin(), unplaced.end());
  }
  for (const std::string& problem : heard_problems_) {
    notes.push_back("speech was lost: " + problem);
  }
  return notes;
}

}  // namespace afterglow::nodes
