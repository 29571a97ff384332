/// \file
/// Draws the console's pictures, one after the other, in one thread that owns the GL context.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <tuple>
#include <utility>

#include "nodes/console/moment_painter.hpp"
#include "nodes/console/picture_source.hpp"

namespace afterglow::nodes {

/// Of each viewer, behavior and view the newest wish wins: one that waits is told 503 "superseded".
/// The last pictures are kept, and the last behaviors' scenes, so that scrubbing forward goes on
/// where it was.
class PictureDesk : public PictureSource {
 public:
  /// The store has to outlive it.
  PictureDesk(const replay::Store& store, PictureSettings settings);
  PictureDesk(const PictureDesk&) = delete;
  PictureDesk& operator=(const PictureDesk&) = delete;
  /// Wishes that wait are told 503.
  ~PictureDesk() override;

  void draw(const PictureWish& wish, Respond respond) override;
  HttpResponse drawNow(const PictureWish& wish) override;

 private:
  using Place = std::tuple<std::string, std::int64_t, PictureView>;  ///< of a waiting wish
  /// Of a behavior with that end, so wide, at that moment.
  using Picture = std::tuple<std::int64_t, std::int64_t, PictureView, int, std::int64_t>;
  struct Waiting {
    PictureWish wish;
    Respond respond;
    std::uint64_t turn = 0;
  };
  struct Easel {
    std::int64_t behavior;
    PictureView view;
    int width;
    std::unique_ptr<MomentPainter> painter;
  };

  void run();
  HttpResponse drawn(const PictureWish& wish, std::list<Easel>& easels,
                     render::GlContext& context);
  MomentPainter& painterOf(const PictureWish& wish, const replay::Behavior& behavior,
                           std::list<Easel>& easels, render::GlContext& context);
  void keep(const Picture& picture, const HttpResponse& response);

  const replay::Store& store_;
  const PictureSettings settings_;

  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<Place, Waiting> waiting_;
  std::uint64_t turns_ = 0;
  std::map<Picture, HttpResponse> kept_;
  std::list<Picture> kept_order_;  ///< the oldest first
  std::size_t kept_bytes_ = 0;
  bool is_ended_ = false;
  std::thread thread_;
};

}  // namespace afterglow::nodes
