#include "nodes/console/console_api.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include "calib/number_text.hpp"
#include "nodes/console/behavior_index.hpp"
#include "nodes/console/behavior_json.hpp"
#include "replay/messages/document.hpp"
#include "replay/query/filter.hpp"
#include "replay/query/outcome.hpp"
#include "replay/query/time_text.hpp"
#include "replay/store/store_reading.hpp"

namespace afterglow::nodes {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMostListed = 1000;
constexpr std::size_t kLongestSearch = 1000;  // bytes
constexpr std::size_t kLongestMessage = 64 << 10;
constexpr double kLongest_s = 1e9;              // of a behavior
constexpr int kNarrowest = 64, kWidest = 1920;  // pixels of a picture

/// Empty for what is no whole number.
std::optional<std::int64_t> integerIn(const std::string& text) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool is_whole = error == std::errc() && end == text.data() + text.size();
  return is_whole ? std::optional(value) : std::nullopt;
}

/// Empty: it is not given. Throws HttpError for what is no whole number.
std::optional<std::int64_t> integerOf(const HttpRequest& request, const std::string& name) {
  const std::string& text = request.parameter(name);
  if (text.empty()) return std::nullopt;
  const auto value = integerIn(text);
  if (!value) throw HttpError(400, name + " should be a whole number");
  return value;
}

std::int64_t neededInteger(const HttpRequest& request, const std::string& name) {
  const auto value = integerOf(request, name);
  if (!value) throw HttpError(400, name + " is missing: a behavior's id");
  return *value;
}

/// Seconds into a behavior, not NaN; `otherwise` if it is not given.
double secondsOf(const HttpRequest& request, const std::string& name = "t", double otherwise = 0) {
  const std::string& text = request.parameter(name);
  if (text.empty()) return otherwise;
  const auto t = calib::numberFromText(text);
  if (!t || !std::isfinite(*t) || std::abs(*t) > kLongest_s) {
    throw HttpError(400, name + " should be a number of seconds");
  }
  return *t;
}

replay::Stamp momentAt(const replay::Behavior& behavior, double t) {
  return {behavior.begin.ns + std::llround(t * 1e9)};
}

/// Returns JSON, with shorter and shorter arrays until it is short enough; null if it is never.
Json shortJson(const replay::Value& value) {
  for (const std::size_t longest : {1024U, 64U, 8U, 0U}) {
    const nlohmann::json json = replay::toJson(value, {longest});
    const auto text = json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
    if (text.size() <= kLongestMessage) return json;
  }
  return nullptr;
}

std::optional<replay::Stamp> stampOf(const HttpRequest& request, const std::string& name) {
  const auto ns = integerOf(request, name);
  return ns ? std::optional<replay::Stamp>({*ns}) : std::nullopt;
}

std::string typeOf(const std::string& name) {
  const std::string ending = name.substr(name.rfind('.') + 1);
  if (ending == "html") return "text/html; charset=utf-8";
  if (ending == "js") return "text/javascript; charset=utf-8";
  if (ending == "css") return "text/css; charset=utf-8";
  if (ending == "svg") return "image/svg+xml";
  return "text/plain; charset=utf-8";
}

/// Returns index.html for "/", a file of its name for "/console/NAME"; nothing for other addresses.
/// A browser that names the ETag of what it has is told 304.
std::optional<HttpResponse> consoleAsset(const HttpRequest& request) {
  const std::string folder = "/console/";
  const bool is_in_folder = request.path.rfind(folder, 0) == 0;
  if (request.method != "GET" || (!is_in_folder && request.path != "/")) return std::nullopt;
  const std::string name = is_in_folder ? request.path.substr(folder.size()) : "index.html";
  for (const EmbeddedConsole* file = kEmbeddedConsole; file->name; ++file) {
    if (name != file->name) continue;
    const std::string tag = fmt::format("\"{:x}\"", std::hash<std::string_view>()(file->text));
    HttpResponse response{200, typeOf(name), file->text, {{"ETag", tag}}};
    response.headers.emplace_back("Cache-Control", "no-cache");
    if (request.header("if-none-match") != tag) return response;
    response.status = 304;
    response.body.clear();
    return response;
  }
  return std::nullopt;
}

}  // namespace

ConsoleApi::ConsoleApi(const replay::Store& store, BehaviorIndex& index, ConsoleAccess access,
                       ConsoleFacts facts)
    : store_(store),
      index_(index),
      access_(std::move(access)),
      facts_(std::move(facts)),
      details_(store, index) {}

bool ConsoleApi::isRobots(const HttpRequest& request) {
  if (request.method == "POST") return request.path != "/api/login";
  return request.path == "/api/events" || request.path == "/api/projected" ||
         request.path == "/api/camera" || request.path == "/api/report" ||
         request.path == "/api/report/page";
}

void ConsoleApi::answer(const HttpRequest& request, const Respond& respond) {
  HttpResponse refused;
  try {
    return answerOrThrow(request, respond);
  } catch (const HttpError& error) {
    refused = errorResponse(error.status(), error.what());
  } catch (const replay::FilterError& error) {
    refused = errorResponse(400, error.what());
  } catch (const replay::StoreError& error) {
    refused = errorResponse(503, error.what());
  } catch (const std::exception& error) {
    refused = errorResponse(500, error.what());
  }
  respond(std::move(refused));
}

void ConsoleApi::answerOrThrow(const HttpRequest& request, const Respond& respond) {
  if (auto refused = access_.refusal(request)) return respond(std::move(*refused));
  if (robot_ && isRobots(request)) return robot_(request, respond);
  const std::string folder = "/api/behaviors/";
  if (request.method != "GET" || request.path.rfind(folder, 0) != 0) {
    return respond(answerNow(request));
  }
  const std::string rest = request.path.substr(folder.size());
  const std::size_t slash = std::min(rest.find('/'), rest.size());
  const auto id = integerIn(rest.substr(0, slash));
  if (!id) throw HttpError(404, "a behavior's id is a whole number");
  answerOf(*id, rest.substr(slash), request, respond);
}

void ConsoleApi::answerOf(std::int64_t id, const std::string& part, const HttpRequest& request,
                          const Respond& respond) {
  if (part.empty()) return respond(jsonResponse(detailJson(*detailOf(id))));
  if (part == "/message") return respond(message(id, request));
  if (part == "/values") return respond(values(id, request));
  if (part == "/sound" && speak_) return respond(sound(id, request));
  if (part == "/picture") return picture(id, request, respond);
  if (part == "/file" && make_file_) return respond(file(id));
  throw HttpError(404, "there is nothing at this address");
}

HttpResponse ConsoleApi::answerNow(const HttpRequest& request) {
  if (auto asset = consoleAsset(request)) return *asset;
  const std::string& path = request.path;
  if (request.method == "POST" && path == "/api/login") return access_.login(request);
  if (isRobots(request)) throw HttpError(404, "no robot: this console reads a store");
  if (path == "/api/about") return about();
  if (path == "/api/behaviors") return behaviors(request);
  if (path == "/api/calendar") return calendar();
  if (path == "/api/compare") return comparison(request);
  throw HttpError(404, "there is nothing at this address");
}

std::shared_ptr<const BehaviorDetail> ConsoleApi::detailOf(std::int64_t id) {
  auto detail = details_.find(id);
  if (!detail) throw HttpError(404, "there is no behavior of this id");
  return detail;
}

HttpResponse ConsoleApi::about() const {
  std::map<std::string, std::size_t> names;
  for (const auto& one : *index_.all()) ++names[one->behavior.name];
  return jsonResponse({{"version", facts_.version},
                       {"store", facts_.store},
                       {"problem", index_.problem()},
                       {"has_robot", robot_ != nullptr},
                       {"needs_token", access_.needsToken()},
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
    const replay::TimeParts local = replay::timeParts(wallBegin(one->behavior));
    Day& day = days[local.day];
    ++day.count;
    day.zone = local.zone;
    if (replay::lookOf(one->behavior.outcome) == replay::OutcomeLook::Bad) ++day.failed;
  }
  auto list = Json::array();
  for (const auto& [name, day] : days) {
    list.push_back(
        {{"day", name}, {"count", day.count}, {"failed", day.failed}, {"zone", day.zone}});
  }
  return jsonResponse(list);
}

HttpResponse ConsoleApi::message(std::int64_t id, const HttpRequest& request) const {
  const auto behavior = store_.behavior(id);
  if (!behavior) throw HttpError(404, "there is no behavior of this id");
  const std::string& topic = request.parameter("topic");
  if (topic.empty()) throw HttpError(400, "topic is missing");
  const auto newest =
      replay::newestMessage(store_, *behavior, topic, momentAt(*behavior, secondsOf(request)));
  if (!newest) throw HttpError(404, "nothing was heard on this topic until then");
  const replay::Channel channel = store_.channel(newest->channel);
  Json json = {
      {"t", static_cast<double>(newest->received.ns - behavior->begin.ns) * 1e-9},
      {"type", channel.type},
      {"bytes", newest->bytes.size()},
      {"value", nullptr}};
  try {
    const auto schema = replay::Schema::of(channel);
    json["value"] = shortJson(replay::decode(schema, newest->bytes));
  } catch (const replay::MessageError& error) {
    json["problem"] = error.what();
  }
  return jsonResponse(json);
}

HttpResponse ConsoleApi::values(std::int64_t id, const HttpRequest& request) const {
  const auto behavior = store_.behavior(id);
  if (!behavior) throw HttpError(404, "there is no behavior of this id");
  const std::string& topic = request.parameter("topic");
  if (topic.empty()) throw HttpError(400, "topic is missing");
  const TopicValues values = topicValues(store_, *behavior, topic, secondsOf(request, "from"),
                                         secondsOf(request, "to", kLongest_s));
  // A number that JSON lacks is null.
  return jsonResponse({{"t", values.t}, {"fields", values.fields}, {"whole", values.is_whole}});
}

HttpResponse ConsoleApi::sound(std::int64_t id, const HttpRequest& request) {
  const auto detail = detailOf(id);
  const std::int64_t place = integerOf(request, "n").value_or(0);
  const auto& said = detail->summary->said;
  if (place < 0 || static_cast<std::size_t>(place) >= said.size()) {
    throw HttpError(404, "it said nothing of this number");
  }
  try {
    return {200, "audio/wav", speak_(said[static_cast<std::size_t>(place)].text)};
  } catch (const std::runtime_error& problem) {
    throw HttpError(503, problem.what());
  }
}

HttpResponse ConsoleApi::comparison(const HttpRequest& request) {
  const auto a = detailOf(neededInteger(request, "a"));
  const auto b = detailOf(neededInteger(request, "b"));
  return jsonResponse(comparisonJson(*a, *b));
}

void ConsoleApi::picture(std::int64_t id, const HttpRequest& request,
                         const Respond& respond) const {
  if (!draw_) throw HttpError(503, facts_.why_no_render);
  PictureRequest wanted;
  wanted.behavior = id;
  wanted.at_first_light = request.parameter("t") == "lit";
  if (!wanted.at_first_light) wanted.t = secondsOf(request);
  const std::string& view = request.parameter("view");
  if (view == "bystander") {
    wanted.view = PictureView::Bystander;
  } else if (!view.empty() && view != "projector") {
    throw HttpError(400, "view should be projector or bystander");
  }
  const std::int64_t width = integerOf(request, "width").value_or(wanted.width);
  wanted.width = static_cast<int>(std::clamp<std::int64_t>(width, kNarrowest, kWidest));
  wanted.viewer = request.parameter("viewer").substr(0, 64);
  draw_(wanted, respond);
}

HttpResponse ConsoleApi::file(std::int64_t id) {
  const auto detail = detailOf(id);
  const std::unique_lock<std::mutex> lock(file_mutex_, std::try_to_lock);
  if (!lock) throw HttpError(503, "another file is being made");
  HttpResponse response{200, "text/html; charset=utf-8", make_file_(*detail)};
  response.headers.emplace_back(
      "Content-Disposition", "attachment; filename=\"behavior_" + std::to_string(id) + ".html\"");
  return response;
}

}  // namespace afterglow::nodes
