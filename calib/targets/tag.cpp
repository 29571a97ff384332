#include "calib/targets/tag.hpp"

#include <apriltag/apriltag.h>
#include <apriltag/tag36h10.h>
#include <apriltag/tag36h11.h>

#include <cstdint>
#include <stdexcept>

namespace afterglow::calib {

const std::vector<std::string> kTagFamilies = {"tag36h11", "tag36h10"};

FamilyHandle makeFamily(const std::string& family) {
  if (family == "tag36h11") return FamilyHandle(tag36h11_create(), tag36h11_destroy);
  if (family == "tag36h10") return FamilyHandle(tag36h10_create(), tag36h10_destroy);
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
