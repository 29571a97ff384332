// Triangles on their way between two programs: whole, or refused.
#include "render/body_bytes.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <stdexcept>

namespace afterglow::render::body_bytes_test {
namespace {

Body triangle() {
  Body body;
  body.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0.5f}};
  body.colors.assign(3, Color{0.5f, 1, 0, 0.25f});
  body.triangles = {{0, 1, 2}};
  return body;
}

TEST(BodyBytes, bringABodyAsItWas) {
  for (const bool colored : {true, false}) {
    Body body = triangle();
    if (!colored) body.colors.clear();
    const Body read = bodyFromBytes(toBytes(body));
    EXPECT_EQ(read.points, body.points);
    EXPECT_EQ(read.colors, body.colors);
    EXPECT_EQ(read.triangles, body.triangles);
  }
}

TEST(BodyBytes, refuseEveryLengthButTheirOwn) {
  const std::string bytes = toBytes(triangle());
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    EXPECT_THROW(bodyFromBytes(bytes.substr(0, length)), std::runtime_error) << length;
  }
  EXPECT_THROW(bodyFromBytes(bytes + 'x'), std::runtime_error);
}

TEST(BodyBytes, refusePointsNobodyHasAndPlacesThatAreNone) {
  Body body = triangle();
  body.triangles[0][1] = 3;
  EXPECT_THROW(bodyFromBytes(toBytes(body)), std::runtime_error);
  body = triangle();
  body.points[2].y() = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(bodyFromBytes(toBytes(body)), std::runtime_error);
  body = triangle();
  body.colors[0].a = std::numeric_limits<float>::infinity();
  EXPECT_THROW(bodyFromBytes(toBytes(body)), std::runtime_error);
  body = triangle();
  body.colors.pop_back();
  EXPECT_THROW(bodyFromBytes(toBytes(body)), std::runtime_error);
}

TEST(BodyBytes, surviveBitsThatFlip) {
  const std::string bytes = toBytes(triangle());
  std::mt19937 random(7);
  for (int i = 0; i < 2000; ++i) {
    std::string bent = bytes;
    for (int flips = 0; flips < 3; ++flips) {
      bent[random() % bent.size()] ^= static_cast<char>(1u << (random() % 8));
    }
    try {
      const Body body = bodyFromBytes(bent);
      for (const auto& t : body.triangles) {
        EXPECT_LT(std::max({t[0], t[1], t[2]}), body.points.size());
      }
    } catch (const std::runtime_error&) {  // as good
    }
  }
}

}  // namespace
}  // namespace afterglow::render::body_bytes_test
