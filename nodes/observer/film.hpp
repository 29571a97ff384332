/// \file
/// A video with the sound of what is said in it.
#pragma once

#include <string>
#include <vector>

#include "nodes/speaker/speech_log.hpp"
#include "nodes/tools/video_writer.hpp"
#include "render/scene/image.hpp"

namespace afterglow::nodes {

/// Images at a constant rate. Errors are VideoWriter's.
class Film {
 public:
  Film(const std::string& path, int width, int height, int fps);

  /// Shows the image after those that were added before.
  void add(const render::Image& image);
  /// Finishes the film, which is either whole or not there. The onsets in `said` count from its
  /// beginning; what sounds is as loud as spoken video usually is. A film without an image is an
  /// error. Where its sound cannot be made, the error says where the film without sound is.
  void close(const std::vector<Utterance>& said);

 private:
  const std::string path_, silent_path_;
  const int fps_;
  std::int64_t count_ = 0;  ///< images written
  VideoWriter writer_;
};

}  // namespace afterglow::nodes
