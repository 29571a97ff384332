/// \file
/// Who draws a behavior's moments for the console.
#pragma once

#include <cstdint>
#include <string>

#include "nodes/console/http_message.hpp"

namespace afterglow::nodes {

enum class PictureView { Projector, Bystander };

struct PictureWish {
  std::int64_t behavior = 0;
  double t = 0;  ///< seconds since its begin
  PictureView view = PictureView::Projector;
  int width = 640;     ///< pixels
  std::string viewer;  ///< of one viewer, behavior and view only the newest wish is drawn
};

/// The header of a picture's response that tells what the picture does not show, and why: a JSON
/// array of lines, in ASCII.
constexpr const char* kDarkHeader = "Afterglow-Dark";

class PictureSource {
 public:
  virtual ~PictureSource() = default;
  /// Returns at once; responds with a JPEG, or with 404 or 503 {"error"}. Any thread.
  virtual void draw(const PictureWish& wish, Respond respond) = 0;
  /// As draw(), but waits for the response.
  virtual HttpResponse drawNow(const PictureWish& wish) = 0;
};

}  // namespace afterglow::nodes
