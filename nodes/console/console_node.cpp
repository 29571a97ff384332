#include "nodes/console/console_node.hpp"

#include <afterglow/StartRecording.h>
#include <afterglow/StopRecording.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "nodes/console/behavior_json.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {
namespace {

/// Then a comment, by which a connection that is gone is noticed.
constexpr int kPeriodsOfSilence = 5;

}  // namespace

ConsoleEvents::ConsoleEvents(Sources sources)
    : sources_(std::move(sources)), total_(sources_.total()) {
  thread_.begin();
}

ConsoleEvents::~ConsoleEvents() {
  thread_.stop();
  std::map<std::uint64_t, Page> pages;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    pages.swap(pages_);
  }
  for (const auto& [number, page] : pages) page.stream->close();
}

HttpResponse ConsoleEvents::open(const std::string& session) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (pages_.size() >= kMostPages) throw HttpError(503, "too many pages listen");
  const std::uint64_t number = ++pages_ever_;
  auto stream = std::make_shared<EventStream>([this, number] { close(number); });
  pages_[number] = {session, stream};
  HttpResponse response{200, "text/event-stream", "retry: 500\n\n" + newest_};
  response.events = stream;
  return response;
}

bool ConsoleEvents::isListening(const std::string& session) const {
  if (session.empty()) return false;
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const auto& [number, page] : pages_) {
    if (page.session == session) return true;
  }
  return false;
}

void ConsoleEvents::close(std::uint64_t page) {
  const std::lock_guard<std::mutex> lock(mutex_);
  pages_.erase(page);
}

/// A stream that is too slow closes itself, which needs the lock.
void ConsoleEvents::tell(const std::string& text) {
  std::vector<std::shared_ptr<EventStream>> streams;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (const auto& [number, page] : pages_) streams.push_back(page.stream);
  }
  for (const auto& stream : streams) stream->push(text);
}

void ConsoleEvents::look() {
  const std::string state = "event: state\ndata: " + sources_.state() + "\n\n";
  const std::size_t total = sources_.total();
  bool is_new = false;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_new = state != newest_;
    newest_ = state;
  }
  if (is_new) tell(state);
  if (total != total_) {
    tell("event: behaviors\ndata: {\"total\":" + std::to_string(total) + "}\n\n");
  }
  total_ = total;
  silent_ = is_new ? 0 : silent_ + 1;
  if (silent_ % kPeriodsOfSilence == kPeriodsOfSilence - 1) tell(":\n\n");
}

namespace {

using nlohmann::json;
using std::chrono::steady_clock;

const char* stateName(const ReplayStatus& status) {
  return status.state == ReplayStatus::PLAYING    ? "playing"
         : status.state == ReplayStatus::PAUSED   ? "paused"
         : status.state == ReplayStatus::TO_START ? "to_start"
                                                  : "idle";
}

std::string wordsOf(const ReplayStatus& status, const RunningReplay::Shown& ours) {
  if (ours.is_stopping) return "is being stopped";
  if (status.state == ReplayStatus::IDLE) {
    if (ours.is_ours) return "the replay is being prepared";
    const std::string& last = ours.last.empty() ? status.message : ours.last;
    return last.empty() ? "nothing is replayed" : "the last replay: " + last;
  }
  const bool is_on_its_way = status.state == ReplayStatus::TO_START;
  const std::string what = (is_on_its_way ? "is on its way to the start of " : "replays ") +
                           status.behavior_name + " (" + std::to_string(status.behavior_id) + ")";
  return status.message.empty() ? what : what + ": " + status.message;
}

nlohmann::ordered_json playerJson(const PlayerLink& player, const RunningReplay::Shown& ours) {
  const auto status = player.status();
  if (!status) return {{"state", "failed"}, {"words", player.player() + " is not there"}};
  nlohmann::ordered_json said{{"state", stateName(*status)},
                              {"behavior", status->behavior_id},
                              {"position", status->position},
                              {"duration", status->duration},
                              {"rate", status->rate},
                              {"words", wordsOf(*status, ours)}};
  const bool is_idle = status->state == ReplayStatus::IDLE;
  if (std::isfinite(status->late_ms)) said["lateness_ms"] = status->late_ms;
  if (std::isfinite(status->skew_ms)) said["skew_ms"] = status->skew_ms;
  if (ours.reports > 0) said["reports"] = ours.reports;
  if (ours.is_ours) said["moved"] = ours.moves;  // of others' it is not known
  if (ours.is_ours && is_idle) {
    said["state"] = "waiting";
    said["behavior"] = ours.behavior;
  }
  if (ours.waits_for_hold) {
    said["words"] = "hold the button: the replay goes on only while it is held";
  }
  return said;
}

template <typename Service>
typename Service::Response called(const std::string& name,
                                  const typename Service::Request& request) {
  Service service;
  service.request = request;
  if (!ros::service::call(name, service)) throw HttpError(503, name + " does not answer");
  if (!service.response.success) throw HttpError(409, service.response.message);
  return service.response;
}

}  // namespace

void MotionTokens::forgetOld(Time now) {
  for (auto made = made_.begin(); made != made_.end();) {
    made = now - made->second.at >= kLifetime ? made_.erase(made) : std::next(made);
  }
}

std::string MotionTokens::make(Found found, Time now) {
  std::string token = replay::newKey();
  const std::lock_guard<std::mutex> lock(mutex_);
  forgetOld(now);
  if (made_.size() >= kMost) {
    made_.erase(std::min_element(made_.begin(), made_.end(), [](const auto& a, const auto& b) {
      return a.second.at < b.second.at;
    }));
  }
  made_[token] = {std::move(found), now};
  return token;
}

std::optional<MotionTokens::Found> MotionTokens::take(const std::string& token, Time now) {
  const std::lock_guard<std::mutex> lock(mutex_);
  forgetOld(now);
  const auto made = made_.find(token);
  if (made == made_.end()) return std::nullopt;
  Found found = std::move(made->second.found);
  made_.erase(made);
  return found;
}

ConsoleNode::ConsoleNode(const ConsoleNodeOptions& options, std::function<std::size_t()> total)
    : options_(options),
      player_(options.player),
      calibrator_(options.calibrator),
      projected_(options.projector),
      camera_(options.camera),
      dead_man_switch_(player_.player()),
      replay_(player_, {[this](const std::string& session) { return events_.isListening(session); },
                        [this](bool runs) { dead_man_switch_.tell(runs); }}),
      events_({[this] { return state(); }, std::move(total)}) {}

std::string ConsoleNode::state() const {
  auto projector = diagnostics_.projector();
  projector["image"] = projected_.state();
  auto calibrator = calibrator_.state();
  if (!calibrator.is_null()) calibrator["image"] = camera_.state();
  const nlohmann::ordered_json state{{"player", playerJson(player_, replay_.shown())},
                                     {"recorder", diagnostics_.recorder()},
                                     {"projector", std::move(projector)},
                                     {"calibrator", std::move(calibrator)},
                                     {"diagnostics", diagnostics_.all()}};
  return state.dump(-1, ' ', false, json::error_handler_t::replace);
}

// ------------------------------------------------------------------------------------------ routes

void ConsoleNode::answer(const HttpRequest& request, const Respond& respond) {
  if (request.method == "POST") return answerPost(request, respond);
  if (request.method != "GET") throw HttpError(404, "there is nothing at this address");
  if (request.path == "/api/projected") return respond(projected_.newest());
  if (request.path == "/api/camera") return respond(camera_.newest());
  if (request.path == "/api/report") return respond(report());
  if (request.path == "/api/report/page") {
    return later(commands_, respond, [this] { return reportPage(); });
  }
  respond(events_.open(request.parameter("session")));
}

void ConsoleNode::answerPost(const HttpRequest& request, const Respond& respond) {
  const std::string& path = request.path;
  if (path == "/api/stop") return respond(stop());  // whatever its body is
  const json asked = bodyOf(request);
  if (path == "/api/hold") return respond(hold(asked));
  if (path == "/api/dry-run") {
    return later(rehearsals_, respond, [this, asked] { return dryRun(asked); });
  }
  if (path == "/api/play") {
    return later(commands_, respond,
                 [this, asked, stops = replay_.stopCount()] { return play(asked, stops); });
  }
  if (path == "/api/record") {
    return later(commands_, respond, [this, asked] { return record(asked); });
  }
  if (path == "/api/record/stop") {
    return later(commands_, respond, [this, asked] { return endRecording(asked); });
  }
  const std::string calibrate = "/api/calibrate/";
  if (path.rfind(calibrate, 0) == 0) {
    const std::string command = path.substr(calibrate.size());
    if (!CalibratorLink::isCommand(command)) throw HttpError(404, "calibrators have no " + command);
    return later(commands_, respond, [this, command] {
      return jsonResponse({{"words", calibrator_.trigger(command)}});
    });
  }
  std::function<void()> command;
  if (path == "/api/pause") {
    command = [this] { player_.trigger("pause"); };
  } else if (path == "/api/resume") {
    command = [this] { replay_.needOurs(), player_.trigger("resume"); };
  } else if (path == "/api/seek") {
    command = [this, t = numberIn(asked, "t")] { replay_.needOurs(), player_.seek(t); };
  } else if (path == "/api/rate") {
    command = [this, rate = numberIn(asked, "rate")] { replay_.needOurs(), player_.setRate(rate); };
  } else {
    throw HttpError(404, "there is nothing at this address");
  }
  later(commands_, respond, [command] {
    command();
    return jsonResponse(nlohmann::ordered_json::object());
  });
}

void ConsoleNode::later(replay::TaskThread& thread, const Respond& respond, Work work) {
  const bool is_taken = thread.post([respond, work = std::move(work)] {
    HttpResponse response;
    try {
      response = work();
    } catch (const HttpError& refused) {
      response = errorResponse(refused.status(), refused.what());
    } catch (const std::exception& failure) {
      response = errorResponse(500, failure.what());
    }
    respond(std::move(response));
  });
  if (!is_taken) throw HttpError(503, "too much is asked at once");
}

HttpResponse ConsoleNode::stop() {
  if (replay_.stop("stopped")) return jsonResponse({{"stopping", true}});
  throw HttpError(503, player_.player() + " does not hear the stop");
}

HttpResponse ConsoleNode::report() const {
  const auto report = replay_.report();
  if (!report) throw HttpError(404, "no replay that was started here has ended yet");
  auto told = nlohmann::ordered_json::parse(report->json, nullptr, false);
  if (!told.is_object()) throw HttpError(503, "the player's report is no JSON");
  return jsonResponse(
      {{"behavior", report->behavior}, {"ended", report->ended}, {"report", std::move(told)}});
}

/// The page is made by the player, which knows more than a report's JSON tells.
HttpResponse ConsoleNode::reportPage() const {
  const auto report = replay_.report();
  if (!report) throw HttpError(404, "no replay that was started here has ended yet");
  const LastReport::Response last = player_.lastReport();
  if (!last.success) throw HttpError(404, last.message);
  if (last.report != report->json) throw HttpError(404, "another replay has ended since");
  return {
      200,
      "text/html; charset=utf-8",
      last.page,
      {{"Content-Security-Policy",
        "default-src 'none'; style-src 'unsafe-inline'; img-src data:; frame-ancestors 'self'"}}};
}

HttpResponse ConsoleNode::hold(const json& asked) {
  const bool is_held = replay_.beat(textIn(asked, "session"));
  return jsonResponse({{"held", is_held}});
}

HttpResponse ConsoleNode::dryRun(const json& asked) {
  const PlayRequest request = readPlayRequest(asked);
  Rehearse::Response dry;
  if (player_.isThere()) {
    dry = player_.rehearse(request);
    if (dry.store != replay::storeUri(options_.store)) {
      dry.topics.clear();
      dry.message =
          "the player plays from another store, " + dry.store + ": its behaviors are others";
    }
  } else {
    dry.message = player_.player() + " is not there";
  }
  std::string token;
  if (dry.message.empty()) {
    token = tokens_.make({request.key(), dry.moves != 0}, steady_clock::now());
  }
  const auto topics = nlohmann::ordered_json::parse(dry.topics, nullptr, false);
  return jsonResponse({{"token", token},
                       {"topics", topics.is_array() ? topics : nlohmann::ordered_json::array()},
                       {"moves", dry.moves != 0},
                       {"robot", dry.robot},
                       {"speed", dry.speed},
                       {"refusal", dry.message},
                       {"unchecked", dry.unchecked}});
}

HttpResponse ConsoleNode::play(const json& asked, std::uint64_t stops_before) {
  RunningReplay::Start start;
  start.request = readPlayRequest(asked);
  start.session = textIn(asked, "session");
  start.is_held = flagIn(asked, "hold");
  start.after_stop = stops_before;
  if (!dead_man_switch_.isThere()) {
    throw HttpError(503, "the process that stops the robot if this console dies is gone: start the "
                         "console again");
  }
  if (!start.request.isWithoutBody()) {
    const auto found = tokens_.take(textIn(asked, "confirmed"), steady_clock::now());
    if (!found || found->key != start.request.key()) {
      throw HttpError(409, "without the token of a dry run of the same request, not older than a "
                           "minute, only light and speech are replayed (\"only\": \"ar,speech\")");
    }
    start.moves = found->moves;
    // What would not have moved then must not move now, whatever has changed since.
    if (!start.moves) start.request.only = "ar,speech";
  }
  if (start.is_held && start.session.empty()) throw HttpError(400, "who holds? session is missing");
  replay_.start(start);
  return jsonResponse({{"waits_for_hold", start.is_held}, {"moves", start.moves}});
}

HttpResponse ConsoleNode::record(const json& asked) const {
  StartRecording::Request request;
  request.name = textIn(asked, "name");
  const auto topics = asked.find("topics");
  if (topics == asked.end() || !topics->is_array()) throw HttpError(400, "topics is no list");
  for (const json& topic : *topics) {
    if (!topic.is_string()) throw HttpError(400, "topics is no list of names");
    request.topics.push_back(topic.get<std::string>());
  }
  const auto answer = called<StartRecording>(options_.recorder + "/start_recording", request);
  return jsonResponse({{"behavior", answer.behavior_id}, {"words", answer.message}});
}

HttpResponse ConsoleNode::endRecording(const json& asked) const {
  StopRecording::Request request;
  request.outcome = textIn(asked, "outcome");
  const auto answer = called<StopRecording>(options_.recorder + "/stop_recording", request);
  return jsonResponse({{"behavior", answer.behavior_id},
                       {"messages", answer.messages},
                       {"lost", answer.dropped},
                       {"words", answer.message}});
}

}  // namespace afterglow::nodes
