#include "nodes/player/media_preparation.hpp"

#include <std_msgs/String.h>

#include <set>
#include <utility>

#include "nodes/conversion/sound_request.hpp"
#include "replay/messages/ranges.hpp"
#include "replay/messages/topic_name.hpp"

namespace afterglow::nodes {
namespace {

bool isAnchored(const replay::PlayPlan& plan, const replay::AnchorSettings& anchors) {
  return replay::anyOf(plan.topics, [&](const replay::PlannedTopic& topic) {
    return topic.isPlayed() && anchors.of(topic.channel) == replay::Anchor::World;
  });
}

}  // namespace

replay::AnchorSettings MediaPreparation::anchorsIn(const replay::PlayPlan& plan,
                                                   const replay::AnchorSettings& settings) {
  const bool plays_tf = replay::contains(plan.playedTopics(), "/tf");
  return plays_tf ? replay::AnchorSettings{settings.frame, replay::Anchor::Body, {}} : settings;
}

bool MediaPreparation::fit(const replay::Store& store, replay::PlayPlan& plan,
                           const replay::AnchorSettings& settings) {
  renewSpeechOutputs(plan);
  return WorldAnchor::refuseUnplaced(store, plan, anchorsIn(plan, settings));
}

MediaPreparation::MediaPreparation(const replay::Store& store, const replay::PlayPlan& plan,
                                   const replay::AnchorSettings& settings,
                                   replay::MessageSink& sink, AnchorBroadcast::Position position)
    : store_(store),
      plan_(plan),
      needs_anchor_([&] {
        replay::PlayPlan asked = plan;
        return fit(store, asked, settings);
      }()),
      media_(store, plan, sink) {
  const replay::AnchorSettings anchors = anchorsIn(plan, settings);
  if (isAnchored(plan, anchors)) anchor_.emplace(store, plan, anchors, std::move(position));
  for (const replay::PlannedTopic& topic : plan.topics) {
    if (topic.isPlayed() && topic.output.type == replay::kSoundRequestType) {
      speech_topic_ = topic.output.topic;
    }
  }
  if (speech_topic_.empty()) return;
  ahead_ = node_.advertise<sound_play::SoundRequest>(speech_topic_ + "/ahead", 100);
  thread_.hear<std_msgs::String>(
      speech_topic_ + "/problem", 100,
      [this](const std_msgs::String& problem) { onProblem(problem.data); });
}

void MediaPreparation::onProblem(const std::string& problem) {
  if (problem.empty()) return;
  heard_problems_.insert(problem);
  if (on_speech_lost_) on_speech_lost_(problem);
}

void MediaPreparation::listen(std::function<void(const std::string&)> on_speech_lost) {
  on_speech_lost_ = std::move(on_speech_lost);
  thread_.begin();
}

void MediaPreparation::prepare(const std::function<bool()>& is_stopped) {
  const Deadline deadline = deadlineIn(kMasterPatience);
  if (!speech_topic_.empty()) tellAhead(deadline, is_stopped);
  if (needs_anchor_) anchor_->waitForAnchor(deadline, is_stopped);
}

void MediaPreparation::tellAhead(Deadline deadline, const std::function<bool()>& is_stopped) {
  const RosGraph graph = askMaster(deadlineIn(kMasterPatience));
  const std::set<std::string> listeners = graph.otherSubscribers(speech_topic_);
  if (replay::anyOf(listeners, isSoundPlay)) media_.speakThroughSoundPlay();
  const std::size_t expected = graph.otherSubscribers(speech_topic_ + "/ahead").size();
  waitUntil(deadline, is_stopped, [&] { return ahead_.getNumSubscribers() >= expected; });
  if (ahead_.getNumSubscribers() == 0) return;
  for (const sound_play::SoundRequest& sentence : sentencesOf(store_, plan_)) {
    ahead_.publish(sentence);
  }
}

std::vector<std::string> MediaPreparation::notes() {
  thread_.stop();
  on_speech_lost_ = nullptr;
  thread_.callRest();
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
