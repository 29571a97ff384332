#include "nodes/console/picture_desk.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <future>
#include <nlohmann/json.hpp>

namespace afterglow::nodes {
namespace {

constexpr std::size_t kMostWaiting = 16, kMostEasels = 6;
constexpr std::size_t kMostKept = 64 << 20;  // bytes
constexpr double kPerSecond = 100;           // moments that are told apart
constexpr std::size_t kLongestHeader = 8000;  // bytes; escaped up to six times as many

HttpResponse superseded() { return errorResponse(503, "superseded"); }

/// The lines as kDarkHeader has them, as many as a browser takes.
std::string headerOf(const std::vector<std::string>& dark) {
  auto lines = nlohmann::json::array();
  std::size_t size = 0;
  for (const std::string& line : dark) {
    size += line.size();
    if (size > kLongestHeader) break;
    lines.push_back(line);
  }
  const std::size_t others = dark.size() - lines.size();
  if (others > 0) lines.push_back("and " + std::to_string(others) + " other reasons");
  return lines.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
}

HttpResponse responseOf(const MomentPicture& picture) {
  return {200, "image/jpeg", jpegOf(picture.image), {{kDarkHeader, headerOf(picture.dark)}}};
}

}  // namespace

PictureDesk::PictureDesk(const replay::Store& store, PictureSettings settings)
    : store_(store), settings_(std::move(settings)) {
  thread_ = std::thread([this] { run(); });
}

PictureDesk::~PictureDesk() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_ended_ = true;
  }
  changed_.notify_all();
  thread_.join();
  for (auto& [place, waiting] : waiting_) waiting.respond(errorResponse(503, "the console ends"));
}

void PictureDesk::draw(const PictureWish& given, Respond respond) {
  PictureWish wish = given;
  wish.t = std::round(wish.t * kPerSecond) / kPerSecond;
  Respond out;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto at = waiting_.find({wish.viewer, wish.behavior, wish.view});
    const auto oldest =
        waiting_.size() < kMostWaiting
            ? waiting_.end()
            : std::min_element(waiting_.begin(), waiting_.end(), [](const auto& a, const auto& b) {
                return a.second.turn < b.second.turn;
              });
    const auto gone = at != waiting_.end() ? at : oldest;
    std::uint64_t turn = ++turns_;
    if (gone != waiting_.end()) {
      out = std::move(gone->second.respond);
      // Who wishes often does not wait the longer for it.
      if (gone == at) turn = gone->second.turn;
      waiting_.erase(gone);
    }
    waiting_[{wish.viewer, wish.behavior, wish.view}] = {wish, std::move(respond), turn};
  }
  changed_.notify_all();
  if (out) out(superseded());
}

HttpResponse PictureDesk::drawNow(const PictureWish& wish) {
  auto answer = std::make_shared<std::promise<HttpResponse>>();
  auto response = answer->get_future();
  draw(wish, [answer](HttpResponse drawn) { answer->set_value(std::move(drawn)); });
  return response.get();
}

void PictureDesk::run() {
  render::GlContext context;
  std::list<Easel> easels;  // gone before the context
  std::unique_lock<std::mutex> lock(mutex_);
  while (!is_ended_) {
    if (waiting_.empty()) {
      changed_.wait(lock);
      continue;
    }
    const auto next =
        std::min_element(waiting_.begin(), waiting_.end(), [](const auto& a, const auto& b) {
          return a.second.turn < b.second.turn;
        });
    Waiting waiting = std::move(next->second);
    waiting_.erase(next);
    lock.unlock();
    waiting.respond(drawn(waiting.wish, easels, context));
    lock.lock();
  }
}

HttpResponse PictureDesk::drawn(const PictureWish& wish, std::list<Easel>& easels,
                                render::GlContext& context) {
  try {
    const auto behavior = store_.behavior(wish.behavior);
    if (!behavior) return errorResponse(404, "there is no behavior of this id");
    const Picture picture(wish.behavior, behavior->end.value_or(behavior->begin).ns, wish.view,
                          wish.width, std::llround(wish.t * kPerSecond));
    const auto kept = kept_.find(picture);
    if (kept != kept_.end()) return kept->second;
    const HttpResponse response =
        responseOf(painterOf(wish, *behavior, easels, context).at(wish.t));
    if (behavior->end) keep(picture, response);
    return response;
  } catch (const std::exception& error) {
    easels.remove_if([&](const Easel& easel) { return easel.behavior == wish.behavior; });
    return errorResponse(503, std::string("no picture: ") + error.what());
  }
}

MomentPainter& PictureDesk::painterOf(const PictureWish& wish, const replay::Behavior& behavior,
                                      std::list<Easel>& easels, render::GlContext& context) {
  // One that has grown, or was cut, is read again.
  easels.remove_if([&](const Easel& easel) {
    return easel.behavior == wish.behavior && easel.painter->behavior().end != behavior.end;
  });
  const auto found = std::find_if(easels.begin(), easels.end(), [&](const Easel& easel) {
    return easel.behavior == wish.behavior && easel.view == wish.view && easel.width == wish.width;
  });
  if (found != easels.end()) {
    easels.splice(easels.begin(), easels, found);
  } else {
    easels.push_front({wish.behavior, wish.view, wish.width,
                       std::make_unique<MomentPainter>(context, store_, behavior, settings_,
                                                       wish.view, wish.width)});
    if (easels.size() > kMostEasels) easels.pop_back();
  }
  return *easels.front().painter;
}

void PictureDesk::keep(const Picture& picture, const HttpResponse& response) {
  kept_bytes_ += response.body.size();
  kept_[picture] = response;
  kept_order_.push_back(picture);
  while (kept_bytes_ > kMostKept) {
    const auto oldest = kept_.find(kept_order_.front());
    kept_bytes_ -= oldest->second.body.size();
    kept_.erase(oldest);
    kept_order_.pop_front();
  }
}

}  // namespace afterglow::nodes
