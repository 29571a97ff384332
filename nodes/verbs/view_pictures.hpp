/// \file
/// The photographs of board poses in a folder: view_NN.png while the projector shows the pattern,
/// and view_NN_plain.png, if it is there, while it shows plain gray.
#pragma once

#include <string>
#include <vector>

#include "calib/detection/observe.hpp"

namespace afterglow::nodes {

struct ViewFiles {
  std::string name;     ///< "view_03"
  std::string pattern;  ///< path
  std::string plain;    ///< path; empty if there is none
};

/// Returns the views by name; PNG and JPEG. Throws std::runtime_error naming the folder if it
/// cannot be read, holds none, or holds a plain picture without its partner.
std::vector<ViewFiles> findViews(const std::string& folder);

/// Throws std::runtime_error naming the picture that cannot be read.
calib::Photographs loadPhotographs(const ViewFiles& files);

}  // namespace afterglow::nodes
