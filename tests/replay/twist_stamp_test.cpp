// Velocities with a header and without.
#include "replay/ros2/twist_stamp.hpp"

#include <gtest/gtest.h>

#include "replay/messages/document.hpp"
#include "replay/messages/field_edit.hpp"
#include "replay/messages/schema.hpp"
#include "tests/support/cdr_bytes.hpp"

namespace afterglow::replay::twist_stamp_test {
namespace {

constexpr const char* kTwistFields =
    "Vector3 linear\nVector3 angular\n====\nMSG: geometry_msgs/Vector3\n"
    "float64 x\nfloat64 y\nfloat64 z\n";
const Schema kTwist = Schema::parse("geometry_msgs/Twist", kTwistFields);
const Schema kStamped = Schema::parse(
    "geometry_msgs/TwistStamped",
    "Header header\nTwist twist\n====\nMSG: geometry_msgs/Twist\n" + std::string(kTwistFields));
constexpr Stamp kNow{1'700'000'000'000'000'007};

Bytes twist() {
  Bytes bytes(48);
  for (std::size_t i = 0; i < 6; ++i) storeNumber(&bytes[8 * i], 0.5 + static_cast<double>(i));
  return bytes;
}

TEST(TwistStamp, isGivenAndTaken) {
  EXPECT_EQ(otherTwist("geometry_msgs/Twist"), "geometry_msgs/TwistStamped");
  EXPECT_EQ(otherTwist("geometry_msgs/TwistStamped"), "geometry_msgs/Twist");
  EXPECT_EQ(otherTwist("geometry_msgs/Pose"), "");
  const Bytes stamped = toOtherTwist("geometry_msgs/Twist", twist(), kNow);
  const Value message = decode(kStamped, stamped);
  EXPECT_EQ(encode(kTwist, *findValue(message, "twist")), twist());
  EXPECT_EQ(headerStamp(kStamped, stamped), kNow);
  EXPECT_EQ(toOtherTwist("geometry_msgs/TwistStamped", stamped, {}), twist());
}

TEST(TwistStamp, isTakenFromAHeaderWithAFrame) {
  Bytes stamped = toOtherTwist("geometry_msgs/Twist", twist(), kNow);
  stamped[12] = 4;
  const std::string frame = "base";
  stamped.insert(stamped.begin() + 16, frame.begin(), frame.end());
  EXPECT_EQ(toOtherTwist("geometry_msgs/TwistStamped", stamped, {}), twist());
}

TEST(TwistStamp, refusesWhatIsNoVelocity) {
  const Bytes stamped = toOtherTwist("geometry_msgs/Twist", twist(), kNow);
  for (const std::size_t size : {0, 3, 15, 16, 47, 63}) {
    const Bytes cut(stamped.begin(), stamped.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_EQ(test::messageErrorOf([&] { toOtherTwist("geometry_msgs/TwistStamped", cut, {}); }),
              std::to_string(size) + " bytes are no geometry_msgs/TwistStamped");
  }
  Bytes boundless = stamped;
  for (std::size_t i = 12; i < 16; ++i) boundless[i] = 255;
  EXPECT_NE(
      test::messageErrorOf([&] { toOtherTwist("geometry_msgs/TwistStamped", boundless, {}); }), "");
  EXPECT_EQ(test::messageErrorOf([&] { toOtherTwist("geometry_msgs/Twist", stamped, {}); }),
            "64 bytes are no geometry_msgs/Twist");
}

}  // namespace
}  // namespace afterglow::replay::twist_stamp_test
