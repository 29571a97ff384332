#include "calib/parallel.hpp"

#include <gtest/gtest.h>

#include <future>
#include <stdexcept>
#include <string>

namespace afterglow::calib::parallel_test {
namespace {

TEST(ForEachIndex, throwsWhatTheLowestIndexThrewWhicheverFailedFirst) {
  std::promise<void> has_failed;
  try {
    forEachIndex(2, 2, [&](std::size_t i) {
      if (i == 0) has_failed.get_future().wait();
      if (i == 1) has_failed.set_value();
      throw std::runtime_error(std::to_string(i));
    });
    ADD_FAILURE() << "nothing was thrown";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "0");
  }
}

}  // namespace
}  // namespace afterglow::calib::parallel_test
