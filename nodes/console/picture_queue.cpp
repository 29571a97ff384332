#include "nodes/console/picture_queue.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <future>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace afterglow::nodes {
namespace {

constexpr std::size_t kMostWaiting = 16, kMostPainters = 6;
constexpr std::size_t kMostKept = 64 << 20;   // bytes
constexpr double kPerSecond = 100;            // moments that are told apart
constexpr std::int64_t kFirstLight = -1;      // in their place
constexpr int kSearched = 320;                // pixels of an image in which light is looked for
constexpr int kNarrowestLarge = 400;          // pixels of an image that is looked at by itself
constexpr std::uint64_t kSmallWait = 4;       // later requests that go before a narrower image
constexpr std::size_t kLongestHeader = 8000;  // bytes; escaped up to six times as many

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

}  // namespace

PictureQueue::PictureQueue(const replay::Store& store, PictureSettings settings)
    : store_(store), settings_(std::move(settings)) {
  settings_.config.projectors.at(0).drawing = render::Drawing::Cpu;
  thread_ = std::thread([this] { run(); });
}

PictureQueue::~PictureQueue() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_ended_ = true;
  }
  changed_.notify_all();
  thread_.join();
  for (auto& [place, waiting] : waiting_) waiting.on_drawn({503, "the console ends", {}, {}});
}

void PictureQueue::draw(const PictureRequest& given, OnDrawn on_drawn) {
  PictureRequest request = given;
  request.t = std::round(request.t * kPerSecond) / kPerSecond;
  OnDrawn superseded;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto at = waiting_.find({request.viewer, request.behavior, request.view});
    const auto oldest =
        waiting_.size() < kMostWaiting
            ? waiting_.end()
            : std::min_element(waiting_.begin(), waiting_.end(), [](const auto& a, const auto& b) {
                return a.second.turn < b.second.turn;
              });
    const auto gone = at != waiting_.end() ? at : oldest;
    std::uint64_t turn = ++turns_ + (request.width < kNarrowestLarge ? kSmallWait : 0);
    if (gone != waiting_.end()) {
      superseded = std::move(gone->second.on_drawn);
      // A viewer who asks often does not wait the longer for it.
      if (gone == at) turn = gone->second.turn;
      waiting_.erase(gone);
    }
    waiting_[{request.viewer, request.behavior, request.view}] = {request, std::move(on_drawn),
                                                                  turn};
  }
  changed_.notify_all();
  if (superseded) superseded({503, "superseded", {}, {}});
}

MomentJpeg PictureQueue::drawNow(const PictureRequest& request) {
  auto answer = std::make_shared<std::promise<Drawn>>();
  auto drawn = answer->get_future();
  draw(request, [answer](const Drawn& one) { answer->set_value(one); });
  Drawn one = drawn.get();
  if (one.status != 200) throw std::runtime_error(one.problem);
  return std::move(one.picture);
}

void PictureQueue::run() {
  render::GlContext context;
  Painters painters;  // gone before the context
  std::unique_lock<std::mutex> lock(mutex_);
  while (!is_ended_) {
    if (waiting_.empty()) {
      changed_.wait(lock);
      continue;
    }
    const auto next = std::min_element(
        waiting_.begin(), waiting_.end(),
        [](const auto& a, const auto& b) { return a.second.turn < b.second.turn; });
    Waiting waiting = std::move(next->second);
    waiting_.erase(next);
    lock.unlock();
    waiting.on_drawn(drawn(waiting.request, painters, context));
    lock.lock();
  }
}

PictureQueue::Drawn PictureQueue::drawn(const PictureRequest& request, Painters& painters,
                                        render::GlContext& context) {
  try {
    const auto behavior = store_.behavior(request.behavior);
    if (!behavior) return {404, "there is no behavior of this id", {}, {}};
    const Picture picture(
        request.behavior, behavior->end.value_or(behavior->begin).ns, request.view, request.width,
        request.at_first_light ? kFirstLight : std::llround(request.t * kPerSecond));
    const auto kept = kept_.find(picture);
    if (kept != kept_.end()) return kept->second;
    Drawn drawn;
    if (request.at_first_light) {
      drawn = drawnAtLight(request, *behavior, context);
    } else {
      MomentPainter& painter = painterFor(request, *behavior, painters, context);
      painter.moveTo(request.t);
      drawn = {200, "", painter.jpeg(), request.t};
    }
    if (behavior->end) keep(picture, drawn);
    return drawn;
  } catch (const std::exception& error) {
    painters.remove_if([&](const KeptPainter& kept) { return kept.behavior == request.behavior; });
    return {503, std::string("no picture: ") + error.what(), {}, {}};
  }
}

/// A list wants one picture of each behavior: its painters are not kept in place of those that
/// somebody scrubs with.
PictureQueue::Drawn PictureQueue::drawnAtLight(const PictureRequest& request,
                                               const replay::Behavior& behavior,
                                               render::GlContext& context) const {
  MomentPainter small(context, store_, behavior, settings_, PictureView::Projector, kSearched);
  const auto t = small.moveToLight();
  MomentPainter painter(context, store_, behavior, settings_, request.view, request.width);
  painter.moveTo(t.value_or(0));
  return {200, "", painter.jpeg(), t};
}

MomentPainter& PictureQueue::painterFor(const PictureRequest& request,
                                        const replay::Behavior& behavior, Painters& painters,
                                        render::GlContext& context) {
  // One that has grown, or was cut, is read again.
  painters.remove_if([&](const KeptPainter& kept) {
    return kept.behavior == request.behavior && kept.painter->behavior().end != behavior.end;
  });
  const auto found = std::find_if(painters.begin(), painters.end(), [&](const KeptPainter& kept) {
    return kept.behavior == request.behavior && kept.view == request.view &&
           kept.width == request.width;
  });
  if (found != painters.end()) {
    painters.splice(painters.begin(), painters, found);
  } else {
    painters.push_front({request.behavior, request.view, request.width,
                         std::make_unique<MomentPainter>(context, store_, behavior, settings_,
                                                         request.view, request.width)});
    if (painters.size() > kMostPainters) painters.pop_back();
  }
  return *painters.front().painter;
}

void PictureQueue::keep(const Picture& picture, const Drawn& drawn) {
  kept_bytes_ += drawn.picture.jpeg.size();
  kept_[picture] = drawn;
  kept_order_.push_back(picture);
  while (kept_bytes_ > kMostKept) {
    const auto oldest = kept_.find(kept_order_.front());
    kept_bytes_ -= oldest->second.picture.jpeg.size();
    kept_.erase(oldest);
    kept_order_.pop_front();
  }
}

HttpResponse pictureResponse(const PictureQueue::Drawn& drawn) {
  if (drawn.status != 200) return errorResponse(drawn.status, drawn.problem);
  return {200,
          "image/jpeg",
          drawn.picture.jpeg,
          {{kDarkHeader, headerOf(drawn.picture.dark)},
           {kMomentHeader, drawn.t ? std::to_string(*drawn.t) : ""}}};
}

}  // namespace afterglow::nodes
