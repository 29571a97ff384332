// Photographs from anywhere: the decoder, and the search for tags in what it makes of them.
#include <stdexcept>

#include "calib/detection/tag_detector.hpp"
#include "calib/picture.hpp"
#include "tests/fuzz/memory_file.hpp"
#include "tests/fuzz/target.hpp"

namespace afterglow::fuzz::picture_fuzz {

AFTERGLOW_FUZZ_TARGET(picture) {
  using namespace calib;
  constexpr int kMostPixels = 1 << 20;  // beyond that a search takes its time, as it may
  static const TagDetector detector("tag36h11");
  const MemoryFile file(data, size);
  try {
    const Picture picture = loadPicture(file.path());
    if (picture.width <= kMostPixels / picture.height) detector.detect(picture);
  } catch (const std::runtime_error&) {
    // The right answer to most inputs.
  }
}

}  // namespace afterglow::fuzz::picture_fuzz
