/// \file
/// The camera_info of the paper's projector as a message that was echoed into a file: the principal
/// point lies below the image, and P, which is for rectified images only, has another.
#pragma once

#include <fstream>
#include <iterator>
#include <string>

#include "tests/support/real_data.hpp"

namespace afterglow::test {

/// K is that of viewsonic() in optics.hpp.
constexpr const char* kProjectorInfo = R"(header:
  seq: 0
  stamp:
    secs: 0
    nsecs: 0
  frame_id: 'beamer'
height: 800
width: 1280
distortion_model: plumb_bob

D: [0.0, 0.0, 0.0, 0.0, 0.0]
K: [1900.0, 0.0, 640.0, 0.0, 1900.0, 817.0, 0.0, 0.0, 1.0]
R: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
P: [1900.0, 0.0, 640, 0.0, 0.0, 1900.0, 770.5, 0.0, 0.0, 0.0, 1.0, 0.0]

binning_x: 0
binning_y: 0
roi:
  x_offset: 0
  y_offset: 0
  height: 0
  width: 0
  do_rectify: false
)";

inline std::string projectorInfo(Source source) {
  if (source == Source::Generated) return kProjectorInfo;
  std::ifstream file(realData("viewsonic_pa503w_camera_info.yaml"));
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace afterglow::test
