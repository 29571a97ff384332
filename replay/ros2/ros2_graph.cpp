#include "replay/ros2/ros2_graph.hpp"

#include <charconv>
#include <stdexcept>
#include <string_view>

#include "replay/messages/text.hpp"
#include "replay/messages/wire.hpp"

namespace afterglow::replay {
namespace {

constexpr std::string_view kTopics = "rt/", kRequests = "rq/", kRequest = "Request";
constexpr std::string_view kBetween = "::dds_::";
/// Ports of higher domains are no ports.
constexpr std::uint32_t kHighestDomain = 232;
constexpr std::size_t kOldGuid = 24;

std::uint32_t domainOf(const char* text) {
  if (!text || !*text) return 0;
  const std::string_view written = text;
  const char* end = written.data() + written.size();
  std::uint32_t domain = 0;
  const auto read = std::from_chars(written.data(), end, domain);
  if (read.ec != std::errc() || read.ptr != end || domain > kHighestDomain) {
    throw std::invalid_argument("ROS_DOMAIN_ID is '" + std::string(written.substr(0, 40)) +
                                "'; expected a number from 0 to 232");
  }
  return domain;
}

bool isSubnet(const std::string& range) {
  if (range == "SUBNET") return true;
  if (range.empty() || range == "LOCALHOST" || range == "SYSTEM_DEFAULT") return false;
  throw std::invalid_argument("ROS_AUTOMATIC_DISCOVERY_RANGE is '" + range.substr(0, 40) +
                              "'; expected LOCALHOST or SUBNET");
}

void putNumber(Bytes& cdr, std::uint32_t number) {
  cdr.resize((cdr.size() + 3) / 4 * 4 + 4);
  storeNumber(&cdr[cdr.size() - 4], number);
}

void putText(Bytes& cdr, const std::string& text) {
  putNumber(cdr, static_cast<std::uint32_t>(text.size() + 1));
  cdr.insert(cdr.end(), text.begin(), text.end());
  cdr.push_back(0);
}

}  // namespace

std::string ddsTopicName(const std::string& topic) { return "rt" + topic; }

std::optional<std::string> topicOfDds(const std::string& dds_topic) {
  if (!beginsWith(dds_topic, kTopics)) return std::nullopt;
  return dds_topic.substr(kTopics.size() - 1);
}

std::string ddsTypeName(const std::string& ros2_type) {
  std::string name;
  const std::size_t last = ros2_type.rfind('/');
  for (std::size_t i = 0; i < ros2_type.size(); ++i) {
    if (i == last) {
      name += kBetween;
    } else if (ros2_type[i] == '/') {
      name += "::";
    } else {
      name += ros2_type[i];
    }
  }
  return name + "_";
}

std::optional<std::string> typeOfDds(const std::string& dds_type) {
  const std::size_t between = dds_type.find(kBetween), first = dds_type.find("::");
  if (between == std::string::npos || first >= between || dds_type.back() != '_') {
    return std::nullopt;
  }
  const std::size_t name = between + kBetween.size();
  const std::string type = dds_type.substr(0, first) + "/" +
                           dds_type.substr(first + 2, between - first - 2) + "/" +
                           dds_type.substr(name, dds_type.size() - 1 - name);
  // Also so that it is no other type's name, which slashes and colons in its parts could make it.
  if (ddsTypeName(type) != dds_type) return std::nullopt;
  return type;
}

ServiceNames serviceNames(const std::string& service, const std::string& type) {
  return {"rq" + service + "Request", ddsTypeName(type + "_Request"), "rr" + service + "Reply",
          ddsTypeName(type + "_Response")};
}

std::optional<std::string> serviceOfDds(const std::string& request_topic) {
  if (!beginsWith(request_topic, kRequests) || !endsWith(request_topic, kRequest)) {
    return std::nullopt;
  }
  const std::size_t begin = kRequests.size() - 1;
  return request_topic.substr(begin, request_topic.size() - kRequest.size() - begin);
}

Bytes nodeAnnouncement(const Bytes& participant, const std::string& node, bool is_before_iron) {
  Bytes cdr = {0, 1, 0, 0};
  cdr.insert(cdr.end(), participant.begin(), participant.end());
  cdr.resize(4 + (is_before_iron ? kOldGuid : participant.size()));
  putNumber(cdr, 1);
  const std::size_t last = node.rfind('/');
  putText(cdr, last == 0 ? "/" : node.substr(0, last));
  putText(cdr, node.substr(last + 1));
  putNumber(cdr, 0);
  putNumber(cdr, 0);
  return cdr;
}

bool isBridged(const std::string& topic) {
  return topic != "/rosout" && topic != "/rosout_agg" && topic != "/parameter_events" &&
         topic.find("/_") == std::string::npos;
}

Ros2Network ros2Network(const std::string& asked,
                        const std::function<const char*(const char*)>& variable) {
  Ros2Network network;
  network.domain = domainOf(variable("ROS_DOMAIN_ID"));
  if (asked.empty()) {
    const char* range = variable("ROS_AUTOMATIC_DISCOVERY_RANGE");
    const char* is_local = variable("ROS_LOCALHOST_ONLY");  // until Humble; it prevails later on
    network.is_subnet =
        isSubnet(range ? range : "") && std::string(is_local ? is_local : "") != "1";
  } else if (asked == "subnet") {
    network.is_subnet = true;
  } else if (asked != "machine") {
    throw std::invalid_argument("~network is '" + asked.substr(0, 40) +
                                "'; expected machine or subnet");
  }
  return network;
}

}  // namespace afterglow::replay
