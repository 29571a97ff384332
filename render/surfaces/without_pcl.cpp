// In place of plane_finder.cpp in builds without PCL: whoever looks for a surface is told so.
#include <stdexcept>

#include "render/surfaces/plane_finder.hpp"

namespace afterglow::render {

FoundPlane findPlane(const std::vector<Eigen::Vector3d>& /*points*/,
                     const PlaneSearch& /*search*/) {
  throw std::runtime_error("this build has no PCL: install libpcl-dev and build again");
}

}  // namespace afterglow::render
