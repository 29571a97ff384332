#include "calib/targets/tag_family.hpp"

#include <apriltag/apriltag.h>
#include <apriltag/tag36h10.h>
#include <apriltag/tag36h11.h>

#include <memory>
#include <stdexcept>

#include "calib/targets/apriltag_family.hpp"

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
  const std::unique_ptr<image_u8_t, void (*)(image_u8_t*)> image(
      apriltag_to_image(handle.get(), static_cast<unsigned>(id)), image_u8_destroy);
  const int rim = (image->width - kTagCells) / 2;  // the white the library draws round the frame
  TagCells black{};
  for (int row = 0; row < kTagCells; ++row) {
    for (int column = 0; column < kTagCells; ++column) {
      black[std::size_t(row)][std::size_t(column)] =
          image->buf[(row + rim) * image->stride + column + rim] < 128;
    }
  }
  return black;
}

}  // namespace afterglow::calib
