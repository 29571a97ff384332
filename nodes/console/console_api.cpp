#include "nodes/console/console_api.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <ctime>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "nodes/console/behavior_json.hpp"
#include "nodes/console/behavior_search.hpp"
#include "nodes/console/console_assets.hpp"
#include "replay/query/filter.hpp"
#include "replay/query/time_text.hpp"

namespace afterglow::nodes {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMostListed = 1000;
constexpr std::size_t kLongestSearch = 1000;  // bytes

/// Empty: it is not given. Throws HttpError for what is no whole number.
std::optional<std::int64_t> integerOf(const HttpRequest& request, const std::string& name) {
  const std::string& text = request.parameter(name);
  if (text.empty()) return std::nullopt;
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) {
    throw HttpError(400, name + " should be a whole number");
  }
  return value;
}

std::optional<replay::Stamp> stampOf(const HttpRequest& request, const std::string& name) {
  const auto ns = integerOf(request, name);
  return ns ? std::optional<replay::Stamp>({*ns}) : std::nullopt;
}

/// Day and zone, "2026-11-23" and "+01:00", in local time.
struct LocalDay {
  std::string day, zone;
};

LocalDay localDay(replay::Stamp stamp) {
  const std::time_t seconds = stamp.ns / 1'000'000'000;
  std::tm time{};
  localtime_r(&seconds, &time);
  std::array<char, 32> day{}, zone{};
  std::strftime(day.data(), day.size(), "%Y-%m-%d", &time);
  std::strftime(zone.data(), zone.size(), "%z", &time);
  std::string sign = zone.data();
  if (sign.size() == 5) sign.insert(3, ":");
  return {day.data(), sign};
}

/// When people saw it: ROS time may be a simulation's.
replay::Stamp wallBegin(const replay::Behavior& behavior) {
  return behavior.wall_begin.ns != 0 ? behavior.wall_begin : behavior.begin;
}

bool hasFailed(const replay::Behavior& behavior) {
  return !behavior.outcome.empty() && behavior.outcome != "success";
}

}  // namespace

ConsoleApi::ConsoleApi(const replay::Store& store, BehaviorIndex& index, ConsoleAccess access,
                       ConsoleFacts facts)
    : store_(store), index_(index), access_(std::move(access)), facts_(std::move(facts)) {}

bool ConsoleApi::isRobots(const HttpRequest& request) const {
  const bool is_posted = request.method == "POST" && request.path != "/api/login";
  return robot_ && (is_posted || request.path == "/api/events" || request.path == "/api/projected");
}

void ConsoleApi::answer(const HttpRequest& request, const Respond& respond) {
  if (isRobots(request)) {
    auto refused = access_.refusal(request);
    return refused ? respond(std::move(*refused)) : robot_(request, respond);
  }
  HttpResponse response;
  try {
    response = answerNow(request);
  } catch (const HttpError& error) {
    response = errorResponse(error.status(), error.what());
  } catch (const replay::FilterError& error) {
    response = errorResponse(400, error.what());
  } catch (const std::exception& error) {
    response = errorResponse(500, error.what());
  }
  respond(std::move(response));
}

HttpResponse ConsoleApi::answerNow(const HttpRequest& request) {
  if (auto refused = access_.refusal(request)) return *refused;
  if (auto asset = consoleAsset(request)) return *asset;
  const std::string& path = request.path;
  if (request.method == "POST" && path == "/api/login") return access_.login(request);
  if (request.method == "POST") throw HttpError(404, "no robot: this console reads a store");
  if (path == "/api/about") return about();
  if (path == "/api/behaviors") return behaviors(request);
  if (path == "/api/calendar") return calendar();
  throw HttpError(404, "there is nothing at this address");
}

HttpResponse ConsoleApi::about() const {
  std::map<std::string, std::size_t> names;
  for (const auto& one : *index_.all()) ++names[one->behavior.name];
  return jsonResponse({{"version", facts_.version},
                       {"store", facts_.store},
                       {"problem", index_.problem()},
                       {"has_robot", robot_ != nullptr},
                       {"can_render", facts_.why_no_render.empty()},
                       {"why_no_render", facts_.why_no_render},
                       {"now", stampText(replay::wallNow())},
                       {"names", names}});
}

HttpResponse ConsoleApi::behaviors(const HttpRequest& request) const {
  BehaviorSearch search;
  search.words = request.parameter("q");
  if (search.words.size() > kLongestSearch) throw HttpError(400, "q is too long");
  search.name = request.parameter("name");
  search.outcome = request.parameter("outcome");
  search.from = stampOf(request, "from");
  search.to = stampOf(request, "to");
  search.before = integerOf(request, "before");
  const auto limit = integerOf(request, "limit");
  if (limit && *limit < 0) throw HttpError(400, "limit should not be negative");
  if (limit) search.limit = std::min<std::size_t>(static_cast<std::size_t>(*limit), kMostListed);
  if (const std::string& where = request.parameter("where"); !where.empty()) {
    replay::BehaviorFilter filter;
    filter.where = std::make_shared<const replay::Filter>(replay::Filter::parse(where));
    search.of_these.emplace();
    for (const auto& behavior : store_.behaviors(filter)) search.of_these->insert(behavior.id);
  }
  const auto all = index_.all();
  const FoundBehaviors found = searchBehaviors(*all, search);
  auto list = Json::array();
  for (const auto& one : found.behaviors) list.push_back(behaviorJson(*one));
  return jsonResponse(
      {{"total", all->size()}, {"matching", found.matching}, {"behaviors", list}});
}

HttpResponse ConsoleApi::calendar() const {
  struct Day {
    std::size_t count = 0, failed = 0;
    std::string zone;
  };
  std::map<std::string, Day> days;
  for (const auto& one : *index_.all()) {
    const LocalDay local = localDay(wallBegin(one->behavior));
    Day& day = days[local.day];
    ++day.count;
    day.zone = local.zone;
    if (hasFailed(one->behavior)) ++day.failed;
  }
  auto list = Json::array();
  for (const auto& [name, day] : days) {
    list.push_back(
        {{"day", name}, {"count", day.count}, {"failed", day.failed}, {"zone", day.zone}});
  }
  return jsonResponse(list);
}

}  // namespace afterglow::nodes
