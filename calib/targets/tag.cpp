#include "calib/targets/tag.hpp"

#include <apriltag/apriltag.h>
extern "C" {  // which AprilTag 3.1's families leave to others
#include <apriltag/tag36h11.h>
}
#if __has_include(<apriltag/tag36h10.h>)
#define AFTERGLOW_HAS_TAG36H10  // AprilTag 3.1, of Debian 11, has not
#include <apriltag/tag36h10.h>
#endif

#include <cstdint>
#include <stdexcept>

namespace afterglow::calib {

#ifdef AFTERGLOW_HAS_TAG36H10
const std::vector<std::string> kTagFamilies = {"tag36h11", "tag36h10"};
#else
const std::vector<std::string> kTagFamilies = {"tag36h11"};
#endif

FamilyHandle makeFamily(const std::string& family) {
  if (family == "tag36h11") return FamilyHandle(tag36h11_create(), tag36h11_destroy);
#ifdef AFTERGLOW_HAS_TAG36H10
  if (family == "tag36h10") return FamilyHandle(tag36h10_create(), tag36h10_destroy);
#else
  if (family == "tag36h10") {
    throw std::invalid_argument("this machine's AprilTag is older than 3.2 and has no tag36h10");
  }
#endif
  throw std::invalid_argument("unknown tag family \"" + family +
                              "\": expected tag36h11 or tag36h10");
}

int tagCount(const std::string& family) { return static_cast<int>(makeFamily(family)->ncodes); }

TagCells tagCells(const std::string& family, int id) {
  const FamilyHandle handle = makeFamily(family);
  if (id < 0 || id >= static_cast<int>(handle->ncodes)) {
    throw std::invalid_argument(family + " has no tag " + std::to_string(id) +
                                ": its ids are 0 to " + std::to_string(handle->ncodes - 1));
  }
  TagCells black;
  for (auto& row : black) row.fill(true);
  const std::uint64_t code = handle->codes[id];
  for (unsigned bit = 0; bit < handle->nbits; ++bit) {
    const bool is_white = (code >> (handle->nbits - 1 - bit) & 1) != 0;
    black[std::size_t(handle->bit_y[bit])][std::size_t(handle->bit_x[bit])] = !is_white;
  }
  return black;
}

}  // namespace afterglow::calib
