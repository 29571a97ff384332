#include "nodes/console/foxglove_protocol.hpp"

#include <algorithm>
#include <iterator>
#include <limits>
#include <set>
#include <stdexcept>

#include "replay/messages/foreign_json.hpp"
#include "replay/messages/wire.hpp"

namespace afterglow::nodes {
namespace {

using nlohmann::json;

// The first byte of binary frames.
constexpr std::uint8_t kClientMessage = 1, kServiceCall = 2, kPlaybackControl = 3;
constexpr char kMessage = 1, kTime = 2, kPlaybackState = 5;

constexpr const char* kNoPublishing =
    "publishing is refused: Afterglow's console shows, and a "
    "replay is what sends";

/// Throws std::runtime_error, one line.
std::uint32_t numberOf(const json& value, const char* what) {
  const bool is_whole = value.is_number_unsigned() &&
                        value.get<std::uint64_t>() <= std::numeric_limits<std::uint32_t>::max();
  if (!is_whole) throw std::runtime_error(std::string(what) + " should be a whole number");
  return value.get<std::uint32_t>();
}

/// Returns an empty text where there is none. Throws as numberOf() does.
std::string textOf(const json& object, const char* name) {
  const auto found = object.find(name);
  if (found == object.end() || found->is_null()) return "";
  if (!found->is_string()) throw std::runtime_error(std::string(name) + " should be a text");
  return found->get<std::string>();
}

const json& arrayOf(const json& object, const char* name) {
  const auto found = object.find(name);
  if (found == object.end() || !found->is_array()) {
    throw std::runtime_error(std::string(name) + " should be an array");
  }
  return *found;
}

SubscribeRequest subscribeRequest(const json& asked) {
  SubscribeRequest request;
  for (const json& one : arrayOf(asked, "subscriptions")) {
    if (!one.is_object()) throw std::runtime_error("a subscription should be an object");
    request.subscriptions.push_back({numberOf(one.value("id", json()), "id"),
                                     numberOf(one.value("channelId", json()), "channelId")});
  }
  return request;
}

UnsubscribeRequest unsubscribeRequest(const json& asked) {
  UnsubscribeRequest request;
  for (const json& id : arrayOf(asked, "subscriptionIds")) {
    request.ids.push_back(numberOf(id, "a subscription's id"));
  }
  return request;
}

ParametersRequest getRequest(const json& asked) {
  ParametersRequest request{{}, textOf(asked, "id")};
  for (const json& name : arrayOf(asked, "parameterNames")) {
    if (!name.is_string()) throw std::runtime_error("a parameter's name should be a text");
    request.names.push_back(name);
  }
  return request;
}

ParametersRequest setRequest(const json& asked) {
  ParametersRequest request{{}, textOf(asked, "id"), true};
  for (const json& parameter : arrayOf(asked, "parameters")) {
    if (!parameter.is_object()) throw std::runtime_error("a parameter should be an object");
    request.names.push_back(textOf(parameter, "name"));
  }
  return request;
}

FoxgloveRequest textRequest(const std::string& text) {
  const auto asked = replay::parseForeignJson<json>(text);
  if (!asked.is_object()) throw std::runtime_error("this is no JSON object");
  const std::string op = textOf(asked, "op");
  if (op == "subscribe") return subscribeRequest(asked);
  if (op == "unsubscribe") return unsubscribeRequest(asked);
  if (op == "getParameters") return getRequest(asked);
  if (op == "setParameters") return setRequest(asked);
  if (op == "advertise" || op == "unadvertise") return RefusedRequest{kNoPublishing};
  throw std::runtime_error("there is no '" + op.substr(0, 64) + "' here");
}

/// [play or pause, speed, whether it seeks, to where, length of the id, id].
PlaybackRequest playbackRequest(const std::string& bytes) {
  constexpr std::size_t kIdAt = 19;  // with the first byte
  const auto* data = reinterpret_cast<const std::uint8_t*>(bytes.data());
  const bool is_long_enough =
      bytes.size() >= kIdAt &&
      bytes.size() - kIdAt >= replay::loadNumber<std::uint32_t>(data + kIdAt - 4);
  if (!is_long_enough || data[1] > 1) throw std::runtime_error("a playback request is malformed");
  PlaybackRequest request;
  request.plays = data[1] == 0;
  request.speed = static_cast<double>(replay::loadNumber<float>(data + 2));
  if (data[6] != 0) {
    constexpr auto kLast = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
    const auto ns = std::min(replay::loadNumber<std::uint64_t>(data + 7), kLast);
    request.seek = replay::Stamp{static_cast<std::int64_t>(ns)};
  }
  request.id = bytes.substr(kIdAt, replay::loadNumber<std::uint32_t>(data + kIdAt - 4));
  return request;
}

FoxgloveRequest binaryRequest(const std::string& bytes) {
  const std::uint8_t kind = bytes.empty() ? 0 : static_cast<std::uint8_t>(bytes[0]);
  if (kind == kPlaybackControl) return playbackRequest(bytes);
  if (kind == kClientMessage) return RefusedRequest{kNoPublishing};
  if (kind == kServiceCall) return RefusedRequest{"calling services is refused"};
  throw std::runtime_error("a binary frame that is not understood");
}

SocketFrame textFrame(const json& object) {
  return {true, object.dump(-1, ' ', false, json::error_handler_t::replace)};
}

template <typename T>
void add(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);  // little endian, as wire.hpp
}

json partsOf(replay::Stamp stamp) {
  return {{"sec", stamp.ns / 1'000'000'000}, {"nsec", stamp.ns % 1'000'000'000}};
}

}  // namespace

FoxgloveRequest readFoxglove(const SocketFrame& frame) {
  try {
    return frame.is_text ? textRequest(frame.bytes) : binaryRequest(frame.bytes);
  } catch (const std::exception& error) {
    return RefusedRequest{error.what()};
  }
}

SocketFrame serverInfoFrame(const FoxgloveServerInfo& info) {
  json told{{"op", "serverInfo"},
            {"name", info.name},
            {"capabilities", info.capabilities},
            {"metadata", {{"ROS_DISTRO", "noetic"}}}};  // by which tools know ROS 1
  if (info.range) {
    told["dataStartTime"] = partsOf(info.range->first);
    told["dataEndTime"] = partsOf(info.range->second);
  }
  return textFrame(told);
}

SocketFrame advertiseFrame(const std::vector<FoxgloveChannel>& channels) {
  json list = json::array();
  for (const FoxgloveChannel& channel : channels) {
    list.push_back({{"id", channel.id},
                    {"topic", channel.topic},
                    {"encoding", "ros1"},
                    {"schemaName", channel.type},
                    {"schemaEncoding", "ros1msg"},
                    {"schema", channel.definition}});
  }
  return textFrame({{"op", "advertise"}, {"channels", list}});
}

SocketFrame unadvertiseFrame(const std::vector<std::uint32_t>& channels) {
  return textFrame({{"op", "unadvertise"}, {"channelIds", channels}});
}

SocketFrame statusFrame(FoxgloveLevel level, const std::string& text) {
  return textFrame({{"op", "status"}, {"level", static_cast<int>(level)}, {"message", text}});
}

SocketFrame parametersFrame(const FoxgloveParameters& parameters, const std::string& id) {
  json list = json::array();
  for (const auto& [name, value] : parameters) {
    list.push_back({{"name", name}, {"value", value}});
    if (value.is_number_float()) list.back()["type"] = "float64";
  }
  json told{{"op", "parameterValues"}, {"parameters", list}};
  if (!id.empty()) told["id"] = id;
  return textFrame(told);
}

SocketFrame timeFrame(replay::Stamp time) {
  std::string bytes(1, kTime);
  add(bytes, static_cast<std::uint64_t>(time.ns));
  return {false, std::move(bytes)};
}

SocketFrame playbackStateFrame(const PlaybackState& state) {
  std::string bytes(1, kPlaybackState);
  add(bytes, static_cast<std::uint8_t>(state.status));
  add(bytes, static_cast<std::uint64_t>(state.at.ns));
  add(bytes, static_cast<float>(state.speed));
  add(bytes, static_cast<std::uint8_t>(state.has_sought));
  add(bytes, static_cast<std::uint32_t>(state.id.size()));
  return {false, bytes + state.id};
}

std::string messageFrame(std::uint32_t subscription, replay::Stamp received, std::size_t size) {
  std::string bytes;
  bytes.reserve(kMessageOffset + size);
  bytes += kMessage;
  add(bytes, subscription);
  add(bytes, static_cast<std::uint64_t>(received.ns));
  bytes.resize(kMessageOffset + size);
  return bytes;
}

void FoxgloveSession::take(const SocketFrame& frame) {
  try {
    std::visit([this](const auto& request) { answer(request); }, readFoxglove(frame));
  } catch (const std::exception& error) {
    say(FoxgloveLevel::Error, error.what());
  }
}

void FoxgloveSession::greet(const FoxgloveServerInfo& info,
                            const std::vector<FoxgloveChannel>& channels) {
  frames_->push(serverInfoFrame(info));
  addChannels(channels);
}

void FoxgloveSession::addChannels(const std::vector<FoxgloveChannel>& channels) {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const FoxgloveChannel& channel : channels) channels_[channel.id] = channel;
  frames_->push(advertiseFrame(channels));
}

void FoxgloveSession::removeChannels(const std::vector<std::uint32_t>& channels) {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const std::uint32_t channel : channels) {
    channels_.erase(channel);
    for (auto at = subscriptions_.begin(); at != subscriptions_.end();) {
      if (at->second == channel) end(at->first);
      at = at->second == channel ? subscriptions_.erase(at) : std::next(at);
    }
  }
  frames_->push(unadvertiseFrame(channels));
}

void FoxgloveSession::add(const FoxgloveSubscription& subscription) {
  const auto channel = channels_.find(subscription.channel);
  if (channel == channels_.end()) {
    throw std::runtime_error("there is no channel " + std::to_string(subscription.channel));
  }
  const bool is_taken =
      std::any_of(subscriptions_.begin(), subscriptions_.end(), [&](const auto& known) {
        return known.first == subscription.id || known.second == subscription.channel;
      });
  if (is_taken) {
    throw std::runtime_error(channel->second.topic +
                             " is subscribed to already, or the "
                             "subscription's id is taken");
  }
  subscriptions_[subscription.id] = subscription.channel;
  begin(subscription, channel->second);
}

void FoxgloveSession::answer(const SubscribeRequest& request) {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const FoxgloveSubscription& subscription : request.subscriptions) {
    try {
      add(subscription);
    } catch (const std::exception& refused) {
      say(FoxgloveLevel::Error, refused.what());
    }
  }
  begun();
}

void FoxgloveSession::answer(const UnsubscribeRequest& request) {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const std::uint32_t id : request.ids) {
    if (subscriptions_.erase(id) > 0) end(id);
  }
}

void FoxgloveSession::answer(const ParametersRequest& request) {
  const std::set<std::string> names(request.names.begin(), request.names.end());
  FoxgloveParameters told, all = parameters();
  for (auto& [name, value] : all) {
    if (names.empty() || names.count(name) > 0) told[name] = std::move(value);
  }
  if (request.sets) say(FoxgloveLevel::Error, "parameters can only be read");
  frames_->push(parametersFrame(told, request.id));
}

void FoxgloveSession::answer(const RefusedRequest& request) {
  say(FoxgloveLevel::Error, request.why);
}

void FoxgloveSession::control(const PlaybackRequest&) {
  throw std::runtime_error("nothing is played here: the messages are live");
}

}  // namespace afterglow::nodes
