/// \file
/// The console's pictures, drawn one after the other in one thread that owns the GL context.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <tuple>
#include <utility>

#include "nodes/behavior_view/moment_painter.hpp"
#include "nodes/console/console_api.hpp"

namespace afterglow::nodes {

/// The header of a picture's response that tells what the picture does not show, and why: a JSON
/// array of lines, in ASCII.
constexpr const char* kDarkHeader = "Afterglow-Dark";

/// The header that tells the picture's moment, in seconds since the behavior's begin; empty where
/// its first lit moment was wanted and it has none.
constexpr const char* kMomentHeader = "Afterglow-Moment";

/// The newest request of each viewer, behavior and view wins: a request that waits is told 503
/// "superseded". Small pictures, which illustrate lists, let some larger ones go first that are
/// requested later. The last pictures are kept, and the last behaviors' painters, so that scrubbing
/// forward goes on where it was. Any thread.
class PictureQueue {
 public:
  struct Drawn {
    int status = 200;
    std::string problem;  ///< a line, unless the status is 200
    MomentJpeg picture;
    std::optional<double> t;  ///< its moment; empty: no light was found, it is of the begin
  };
  using OnDrawn = std::function<void(const Drawn&)>;

  /// The store has to outlive it. Draws by the CPU, whatever the configuration says.
  PictureQueue(const replay::Store& store, PictureSettings settings);
  PictureQueue(const PictureQueue&) = delete;
  PictureQueue& operator=(const PictureQueue&) = delete;
  /// Requests that wait are told 503.
  ~PictureQueue();

  /// Returns at once.
  void draw(const PictureRequest& request, OnDrawn on_drawn);
  /// Waits for the picture. Throws std::runtime_error with the problem.
  MomentJpeg drawNow(const PictureRequest& request);

 private:
  using Place = std::tuple<std::string, std::int64_t, PictureView>;  ///< place of a waiting request
  /// The key of a picture: of a behavior with that end, so wide, at that moment.
  using Picture = std::tuple<std::int64_t, std::int64_t, PictureView, int, std::int64_t>;
  struct Waiting {
    PictureRequest request;
    OnDrawn on_drawn;
    std::uint64_t turn = 0;
  };
  struct KeptPainter {
    std::int64_t behavior;
    PictureView view;
    int width;
    std::unique_ptr<MomentPainter> painter;
  };
  using Painters = std::list<KeptPainter>;  ///< the last used first

  void run();
  Drawn drawn(const PictureRequest& request, Painters& painters, render::GlContext& context);
  Drawn drawnAtLight(const PictureRequest& request, const replay::Behavior& behavior,
                     render::GlContext& context) const;
  MomentPainter& painterFor(const PictureRequest& request, const replay::Behavior& behavior,
                            Painters& painters, render::GlContext& context);
  void keep(const Picture& picture, const Drawn& drawn);

  const replay::Store& store_;
  PictureSettings settings_;

  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<Place, Waiting> waiting_;
  std::uint64_t turns_ = 0;
  std::map<Picture, Drawn> kept_;
  std::list<Picture> kept_order_;  ///< the oldest first
  std::size_t kept_bytes_ = 0;
  bool is_ended_ = false;
  std::thread thread_;
};

/// Returns the response to a request for a picture.
HttpResponse pictureResponse(const PictureQueue::Drawn& drawn);

}  // namespace afterglow::nodes
