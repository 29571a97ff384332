#include "nodes/player/media_sink.hpp"

#include <std_msgs/String.h>

#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>
#include <utility>

#include "calib/file_replacement.hpp"
#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/conversion/sound_request.hpp"
#include "nodes/recorder/world_snapshot.hpp"
#include "replay/messages/foreign_json.hpp"
#include "replay/messages/ranges.hpp"
#include "replay/messages/topic_name.hpp"
#include "replay/store/checksum.hpp"

namespace afterglow::nodes {
namespace {

namespace fs = std::filesystem;
namespace traits = ros::message_traits;
using sound_play::SoundRequest;

/// A speaker remembers so many.
constexpr std::size_t kMostSentences = 60;
constexpr std::size_t kMostUris = 10'000;

bool isSpeech(const replay::Channel& channel) { return channel.type == replay::kSoundRequestType; }

std::string defaultFolder() {
  const char* cache = std::getenv("XDG_CACHE_HOME");
  const char* home = std::getenv("HOME");
  const fs::path root =
      cache && *cache ? fs::path(cache) : fs::path(home ? home : "/tmp") / ".cache";
  return (root / "afterglow" / "files").string();
}

/// ".wav", if it is one: names come from recordings.
std::string extensionOf(const std::string& uri) {
  const std::string extension = fs::path(uri).extension().string();
  const bool is_plain =
      extension.size() < 8 && replay::allOf(extension, [](unsigned char c) {
        return std::isalnum(c) != 0 || c == '.';
      });
  return is_plain ? extension : "";
}

replay::Bytes bytesOf(const SoundRequest& request) {
  replay::Bytes bytes(ros::serialization::serializationLength(request));
  ros::serialization::OStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  ros::serialization::serialize(stream, request);
  return bytes;
}

}  // namespace

void renewSpeechOutputs(replay::PlayPlan& plan) {
  for (replay::PlannedTopic& topic : plan.topics) {
    if (!isSpeech(topic.output)) continue;
    topic.output.md5 = traits::MD5Sum<SoundRequest>::value();
    topic.output.definition = traits::Definition<SoundRequest>::value();
  }
}

std::vector<SoundRequest> sentencesOf(const replay::Store& store, const replay::PlayPlan& plan) {
  std::vector<SoundRequest> sentences;
  replay::MessageRange range;
  for (const replay::PlannedTopic& topic : plan.topics) {
    if (topic.isPlayed() && isSpeech(topic.channel)) range.topics.push_back(topic.channel.topic);
  }
  if (range.topics.empty()) return sentences;
  range.begin = plan.begin;
  range.end = plan.end;
  const auto messages = store.messages(plan.behavior, range);
  while (sentences.size() < kMostSentences) {
    const auto message = messages->next();
    if (!message) break;
    const auto request = soundRequestOf(store.channel(message->channel), message->bytes);
    if (!request || request->sound != SoundRequest::SAY) continue;
    const bool is_known = replay::anyOf(sentences, [&](const SoundRequest& known) {
      return known.arg == request->arg && known.arg2 == request->arg2;
    });
    if (!is_known) sentences.push_back(*request);
  }
  return sentences;
}

MediaSink::MediaSink(const replay::Store& store, const replay::PlayPlan& plan,
                     replay::MessageSink& sink, std::string cache_folder)
    : sink_(sink), cache_folder_(cache_folder.empty() ? defaultFolder() : std::move(cache_folder)) {
  for (const replay::PlannedTopic& planned : plan.topics) {
    if (!planned.isPlayed()) continue;
    const replay::Channel& output = planned.output;
    auto references = std::make_unique<replay::FileReferences>(replay::Schema::of(output));
    if (references->any()) {
      topics_[output.topic] = Topic{planned.channel, std::move(references)};
    }
  }
  if (!topics_.empty()) fetchFiles(store, plan.behavior);
}

void MediaSink::fetchFiles(const replay::Store& store, const replay::Behavior& behavior) {
  const auto snapshot = replay::parseForeignJson(behavior.snapshot);
  const auto files = snapshot.is_object() ? snapshot.find("files") : snapshot.end();
  if (!snapshot.is_object() || files == snapshot.end() || !files->is_object()) return;
  for (const auto& [uri, hash] : files->items()) {
    if (!hash.is_string() || isHere(uri)) continue;
    try {
      replacements_[uri] = fetch(store, uri, hash.get<std::string>());
      notes_.push_back("'" + printable(uri) + "' is not on this machine: taken from the store, " +
                       replacements_[uri] +
                       " (for meshes a folder of projector_node's mesh_roots)");
    } catch (const std::runtime_error& error) {
      notes_.push_back("'" + printable(uri) + "' is lost: not on this machine, and " +
                       error.what());
      replacements_[uri] = "";
    }
  }
}

std::string MediaSink::fetch(const replay::Store& store, const std::string& uri,
                             const std::string& sha256) {
  const auto contents = store.file(sha256);
  if (!contents) throw std::runtime_error("the store has lost it");
  if (replay::sha256(*contents) != sha256) throw std::runtime_error("damaged in the store");
  const fs::path path = fs::path(cache_folder_) / (sha256 + extensionOf(uri));
  std::error_code error;
  if (fs::file_size(path, error) != contents->size() || error) {
    calib::replaceFile(path.string(), {contents->begin(), contents->end()});
  }
  return "file://" + path.string();
}

std::string MediaSink::replacementFor(const std::string& uri) {
  const auto known = replacements_.find(uri);
  if (known != replacements_.end()) return known->second;
  if (replacements_.size() >= kMostUris) return "";
  if (!isHere(uri)) {
    notes_.push_back("'" + printable(uri) + "' is lost: neither on this machine nor in the store");
  }
  return replacements_[uri] = "";
}

void MediaSink::renameVoice(SoundRequest& request) {
  if (request.sound != SoundRequest::SAY) return;
  const std::string voice = soundPlayVoice(request.arg2);
  if (voice == request.arg2) return;
  if (renamed_voices_.size() < kMostSentences && renamed_voices_.insert(request.arg2).second) {
    notes_.push_back("sound_play has no voice '" + printable(request.arg2) + "': it is asked for " +
                     voice);
  }
  request.arg2 = voice;
}

bool MediaSink::publish(const replay::Channel& channel, const replay::Bytes& bytes) {
  const auto found = topics_.find(channel.topic);
  if (found == topics_.end()) return sink_.publish(channel, bytes);
  const Topic& topic = found->second;
  replay::Bytes changed = bytes;
  if (isSpeech(channel) && (has_sound_play_ || topic.recorded.md5 != channel.md5)) {
    auto request = soundRequestOf(topic.recorded, bytes);
    if (!request) throw replay::MessageError("no sound request");
    if (has_sound_play_) renameVoice(*request);
    changed = bytesOf(*request);
  }
  topic.references->replace(changed,
                            [this](const std::string& uri) { return replacementFor(uri); });
  return sink_.publish(channel, changed);
}

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
