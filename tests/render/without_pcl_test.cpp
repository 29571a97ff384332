// A build without PCL: this program has render/surfaces/without_pcl.cpp in whichever build.
#include <gtest/gtest.h>

#include <stdexcept>

#include "render/surfaces/plane_finder.hpp"

namespace afterglow::render::without_pcl_test {
namespace {

TEST(WithoutPcl, whoLooksForASurfaceIsToldWhatIsMissing) {
  try {
    findPlane({}, {});
    ADD_FAILURE() << "not refused";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "this build has no PCL: install libpcl-dev and build again");
  }
}

}  // namespace
}  // namespace afterglow::render::without_pcl_test
