#include "nodes/recorder/recording_request.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "replay/messages/foreign_json.hpp"
#include "replay/messages/topic_name.hpp"

namespace afterglow::nodes {

replay::Behavior checkedBehavior(replay::Behavior asked) {
  if (asked.name.empty()) {
    throw std::invalid_argument("name is empty: a behavior is found by its name");
  }
  std::vector<std::string> topics;
  for (const std::string& topic : asked.topics) {
    const std::string checked = replay::TopicName(topic).text();
    if (std::find(topics.begin(), topics.end(), checked) == topics.end()) {
      topics.push_back(checked);
    }
  }
  asked.topics = std::move(topics);
  if (asked.parameters.empty()) {
    asked.parameters = "{}";
  }
  if (!replay::parseForeignJson(asked.parameters).is_object()) {
    throw std::invalid_argument("parameters are no JSON object: " + asked.parameters);
  }
  return asked;
}

std::set<std::string> outcomes(const std::string& list) {
  std::set<std::string> words;
  std::string spaced = list;
  std::replace(spaced.begin(), spaced.end(), ',', ' ');
  std::istringstream stream(spaced);
  std::string word;
  while (stream >> word) {
    words.insert(word);
  }
  return words;
}

RecordingRequest checkedRequest(const RecordingOptions& asked) {
  RecordingRequest request;
  replay::Behavior& behavior = request.behavior;
  behavior.name = asked.name;
  behavior.topics = asked.topics;
  behavior.tree_path = asked.tree_path;
  behavior.parameters = asked.parameters;
  behavior.tags = asked.tags;
  behavior.attempt = std::max(0, asked.attempt);
  behavior = checkedBehavior(std::move(behavior));
  request.choice = {asked.regexes, asked.exclude, asked.all};
  if (behavior.topics.empty() && !request.choice.isOpen()) {
    throw std::invalid_argument("no topics are named");
  }
  for (const std::string& limit : asked.limits) {
    request.terms.limits.push_back(replay::TopicLimit::parse(limit));
  }
  if (!(asked.pre_roll_s >= 0 && asked.pre_roll_s <= 3600)) {
    throw std::invalid_argument("pre_roll must be 0 to 3600 seconds");
  }
  request.terms.pre_roll_ns = std::llround(asked.pre_roll_s * 1e9);
  request.keep_if = outcomes(asked.keep_if);
  return request;
}

}  // namespace afterglow::nodes
