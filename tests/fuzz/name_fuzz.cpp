// Names of topics, frames, namespaces, types and services, as messages, files, options and the
// graphs of ROS 1 and ROS 2 have them. An input is lines: a name, two namespaces, a prefix of
// frames, and a pattern.
#include <algorithm>
#include <cstdlib>
#include <sstream>
#include <stdexcept>

#include "replay/messages/topic_name.hpp"
#include "replay/plan/anchoring.hpp"
#include "replay/query/regular_expression.hpp"
#include "replay/ros2/ros2_graph.hpp"
#include "tests/fuzz/target.hpp"

namespace afterglow::fuzz::name_fuzz {
namespace {

using namespace replay;

void require(bool condition) {
  if (!condition) std::abort();
}

/// A refusal is one line.
template <typename Read>
void readOrRefuse(const Read& read) {
  try {
    read();
  } catch (const std::invalid_argument& refusal) {
    const std::string text = refusal.what();
    require(!text.empty() && text.find('\n') == std::string::npos);
  }
}

void cleanTopic(const std::string& name) {
  readOrRefuse([&] { require(TopicName(name).text() == name); });
  const auto clean = TopicName::cleaned(name);
  if (!clean) return;
  require(TopicName(clean->text()) == *clean);
  require(TopicName::cleaned(clean->text()) == clean);
  require(topicOfDds(ddsTopicName(clean->text())) == clean->text());
  readOrRefuse([&] { require(clean->in("/robot1").text() == "/robot1" + clean->text()); });
  const std::string action = actionOf(clean->text());
  require(clean->text().compare(0, action.size(), action) == 0);
}

void nameOfDds(const std::string& name) {
  if (const auto topic = topicOfDds(name)) require(ddsTopicName(*topic) == name);
  if (const auto type = typeOfDds(name)) require(ddsTypeName(*type) == name);
  if (const auto service = serviceOfDds(name)) {
    require(serviceNames(*service, "a/srv/B").request_topic == name);
  }
}

/// Names go from one robot to another and back.
void renameRobot(const std::string& name, const std::string& from, const std::string& to,
                 const std::string& prefix) {
  const std::string name_space = cleanNamespace(from), other = cleanNamespace(to);
  require(cleanNamespace(name_space) == name_space);
  readOrRefuse([&] { checkNamespace(name_space); });
  const RobotNames here = findRobotNames(
      name_space, prefix, [&](const std::string& frame) { return frame.size() % 2 == 0; });
  require(here.topic(here.topic(name)) == here.topic(name));
  require(here.frame(here.frame(name)) == here.frame(name));
  const RobotRenaming there = renamingTo(here, other, prefix);
  const RobotRenaming back{there.live, there.recorded};
  if (!name_space.empty() && !other.empty()) {
    const std::string own = name_space + "/" + name;
    require(back.topic(there.topic(own)) == own);
  }
  if (!here.frame_prefix.empty() && !there.live.frame_prefix.empty()) {
    const std::string own = here.frame_prefix + "/" + name;
    require(back.frame(there.frame(own)) == own);
  }
}

}  // namespace

AFTERGLOW_FUZZ_TARGET(name) {
  std::istringstream lines(std::string(data, data + size));
  std::string name, from, to, prefix, pattern;
  for (std::string* line : {&name, &from, &to, &prefix, &pattern}) std::getline(lines, *line);
  cleanTopic(name);
  nameOfDds(name);
  renameRobot(name, from, to, prefix);
  readOrRefuse([&] { AnchorSettings().add(name); });
  readOrRefuse([&] { RegularExpression::ofNames(pattern).isWhole(name); });
  readOrRefuse([&] {
    ros2Network(name,
                [&](const char* variable) { return *variable == 'R' ? from.c_str() : nullptr; });
  });
}

}  // namespace afterglow::fuzz::name_fuzz
