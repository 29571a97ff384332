#include "nodes/conversion/cloud_conversion.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include "nodes/conversion/geometry_conversion.hpp"
#include "tests/support/cloud_messages.hpp"

namespace afterglow::nodes::cloud_conversion_test {
namespace {

using sensor_msgs::PointCloud2;
using sensor_msgs::PointField;
using test::cloudMessage;

const std::vector<Eigen::Vector3f> kThree = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}};

PointField field(const std::string& name, std::uint32_t offset, std::uint8_t datatype) {
  PointField f;
  f.name = name;
  f.offset = offset;
  f.datatype = datatype;
  f.count = 1;
  return f;
}

std::string reasonFor(const PointCloud2& message, CloudStyle style = {}) {
  const auto cloud = toPointCloud(message, style);
  EXPECT_FALSE(cloud.value.has_value());
  return cloud.reason;
}

CloudStyle colored(ColorSource source) {
  CloudStyle style;
  style.color = source;
  return style;
}

template <typename T>
void put(PointCloud2& message, std::size_t at, T value) {
  std::memcpy(message.data.data() + at, &value, sizeof(T));
}

TEST(CloudConversion, readsPointsByNameAndOffset) {
  PointCloud2 message = cloudMessage("map", kThree, 20);
  std::swap(message.fields[0].name, message.fields[2].name);  // z y x
  CloudStyle style;
  style.style = render::PointStyle::Boxes;
  style.size = 0.005f;
  const auto cloud = toPointCloud(message, style);
  ASSERT_TRUE(cloud.value) << cloud.reason;
  EXPECT_EQ(cloud.value->points[1], Eigen::Vector3f(6, 5, 4));
  EXPECT_EQ(cloud.value->style, render::PointStyle::Boxes);
  EXPECT_EQ(cloud.value->size, 0.005f);
  EXPECT_TRUE(cloud.value->colors.empty());
}

TEST(CloudConversion, honorsRowStep) {
  PointCloud2 message = cloudMessage("map", kThree);
  message.height = 3;
  message.width = 1;
  message.row_step = 16;  // four bytes of padding
  message.data.assign(3 * 16, 0);
  for (std::size_t i = 0; i < 3; ++i) std::memcpy(&message.data[i * 16], kThree[i].data(), 12);
  const auto cloud = toPointCloud(message, {});
  ASSERT_TRUE(cloud.value) << cloud.reason;
  EXPECT_EQ(cloud.value->points, kThree);
  message.data.resize(2 * 16 + 12);  // the last row's padding may be missing
  EXPECT_TRUE(toPointCloud(message, {}).value);
  message.row_step = 8;
  EXPECT_EQ(reasonFor(message), "row_step is shorter than a row");
}

TEST(CloudConversion, readsDoublesAndBigEndian) {
  PointCloud2 message = cloudMessage("map", {kThree[0]}, 24);
  for (std::size_t i = 0; i < 3; ++i) {
    message.fields[i] =
        field(message.fields[i].name, static_cast<std::uint32_t>(8 * i), PointField::FLOAT64);
    put(message, 8 * i, 0.5 + static_cast<double>(i));
    std::reverse(message.data.begin() + static_cast<long>(8 * i),
                 message.data.begin() + static_cast<long>(8 * i + 8));
  }
  message.is_bigendian = 1;
  const auto cloud = toPointCloud(message, {});
  ASSERT_TRUE(cloud.value) << cloud.reason;
  EXPECT_EQ(cloud.value->points[0], Eigen::Vector3f(0.5f, 1.5f, 2.5f));
}

TEST(CloudConversion, dropsPointsThatAreNotFiniteOrAbsurdlyFar) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float inf = std::numeric_limits<float>::infinity();
  PointCloud2 message = cloudMessage("map", {{nan, 0, 0}, {0, inf, 0}, {0, 0, 1e30f}, {1, 1, 1}});
  message.is_dense = 1;  // which is not true
  EXPECT_EQ(toPointCloud(message, {}).value->points.size(), 1u);
}

TEST(CloudConversion, takesAnEmptyCloudForAValueWhateverItsFields) {
  const auto cloud = toPointCloud(PointCloud2(), {});
  ASSERT_TRUE(cloud.value);
  EXPECT_TRUE(cloud.value->points.empty());
  EXPECT_TRUE(toPointCloud(cloudMessage("map", {}), {}).value);
}

TEST(CloudConversion, refusesDataShorterThanDeclared) {
  PointCloud2 message = cloudMessage("map", kThree);
  message.data.pop_back();
  EXPECT_EQ(reasonFor(message), "data is shorter than declared");
  message.data.clear();
  EXPECT_EQ(reasonFor(message), "data is shorter than declared");
}

TEST(CloudConversion, refusesPointsOfNoSizeUnlessThereAreNone) {
  PointCloud2 message = cloudMessage("map", kThree);
  message.point_step = 0;
  EXPECT_EQ(reasonFor(message), "point_step is 0");
  message.width = 0;
  EXPECT_TRUE(toPointCloud(message, {}).value);
}

TEST(CloudConversion, doesNotOverflowOnHugeSizes) {
  PointCloud2 message = cloudMessage("map", kThree);
  message.width = 65536;  // the product is 65536 in 32 bits
  message.height = 65537;
  message.row_step = message.width * message.point_step;
  EXPECT_EQ(reasonFor(message), "data is shorter than declared");
  message.width = message.height = message.point_step = 0xffffffffu;
  message.row_step = 0xffffffffu;
  EXPECT_EQ(reasonFor(message), "row_step is shorter than a row");
  message.width = 1;
  EXPECT_EQ(reasonFor(message), "data is shorter than declared");
  message.height = 1;
  EXPECT_EQ(reasonFor(message), "data is shorter than declared");
}

TEST(CloudConversion, thinsOutACloudAboveTheBudgetEvenlyAndSaysSo) {
  constexpr std::uint32_t kColumns = 1501, kRows = 1001;  // above the budget, below twice that
  PointCloud2 message = cloudMessage("map", std::vector<Eigen::Vector3f>(kColumns * kRows));
  message.width = kColumns;
  message.height = kRows;
  message.row_step = kColumns * message.point_step;
  for (std::uint32_t i = 0; i < kColumns * kRows; ++i)
    put(message, 12 * i, 0.5f * static_cast<float>(i));
  const auto cloud = toPointCloud(message, {});
  ASSERT_TRUE(cloud.value);
  EXPECT_EQ(cloud.reason, "too many points: some are left out");
  ASSERT_EQ(cloud.value->points.size(), (kColumns * kRows + 1) / 2);
  EXPECT_LE(cloud.value->points.size(), kMostCloudPoints);
  for (std::size_t i = 0; i < cloud.value->points.size(); ++i) {  // over the ends of rows, too
    ASSERT_EQ(cloud.value->points[i].x(), static_cast<float>(i));
  }
}

TEST(CloudConversion, takesTheDeclaredPartOfLongerData) {
  PointCloud2 message = cloudMessage("map", kThree);
  message.data.push_back(1);
  const auto cloud = toPointCloud(message, {});
  ASSERT_TRUE(cloud.value);
  EXPECT_EQ(cloud.value->points.size(), 3u);
  EXPECT_EQ(cloud.reason, "data is longer than declared");
}

TEST(CloudConversion, refusesFieldsItCannotRead) {
  PointCloud2 message = cloudMessage("map", kThree);
  message.fields[2].offset = 9;
  EXPECT_EQ(reasonFor(message), "field 'z' lies beyond the point");
  message.fields[2].offset = 0xfffffffeu;
  EXPECT_EQ(reasonFor(message), "field 'z' lies beyond the point");
  message.fields.pop_back();
  EXPECT_EQ(reasonFor(message), "no field 'z'");
  message = cloudMessage("map", kThree);
  message.fields[0].datatype = PointField::INT16;
  EXPECT_EQ(reasonFor(message), "field 'x' is of another type than can be read");
  message.fields[0].datatype = 77;
  EXPECT_EQ(reasonFor(message), "field 'x' is of another type than can be read");
}

TEST(CloudConversion, takesTheFirstOfTwoFieldsOfOneNameAndSaysSo) {
  PointCloud2 message = cloudMessage("map", {kThree[0]});
  message.fields.push_back(field("x", 4, PointField::FLOAT32));
  const auto cloud = toPointCloud(message, {});
  EXPECT_EQ(cloud.value->points[0].x(), 1);
  EXPECT_EQ(cloud.reason, "field 'x' more than once: the first counts");
}

TEST(CloudConversion, takesTheFirstNumberOfAFieldOfAnotherCountAndSaysSo) {
  for (const std::uint32_t count : {0u, 3u, 0xffffffffu}) {
    PointCloud2 message = cloudMessage("map", {kThree[0]});
    message.fields[0].count = count;
    const auto cloud = toPointCloud(message, {});
    ASSERT_TRUE(cloud.value) << count;
    EXPECT_EQ(cloud.value->points[0], kThree[0]);
    EXPECT_EQ(cloud.reason, "field 'x' is not of one number: the first counts");
  }
}

/// So many that workers share them; what some leave out must not leave gaps.
TEST(CloudConversion, readsManyPointsInTheirOrder) {
  constexpr std::size_t kCount = 123'457;
  render::Workers three(3);
  std::vector<Eigen::Vector3f> points, expected;
  std::vector<std::uint8_t> reds;
  for (std::size_t i = 0; i < kCount; ++i) {
    points.emplace_back(static_cast<float>(i), 1, i % 7 == 3 || i < 50'000 ? std::nanf("") : 2);
    if (std::isnan(points.back().z())) continue;
    expected.push_back(points.back());
    reds.push_back(static_cast<std::uint8_t>(i));
  }
  PointCloud2 message = cloudMessage("map", points, 16);
  message.fields.push_back(field("rgb", 12, PointField::FLOAT32));
  for (std::size_t i = 0; i < kCount; ++i) {
    put<std::uint32_t>(message, 16 * i + 12, static_cast<std::uint32_t>(i & 0xff) << 16);
  }
  for (render::Workers* workers : {&three, static_cast<render::Workers*>(nullptr)}) {
    EXPECT_EQ(toPointCloud(message, {}, workers).value->points.get(), expected);
    const auto cloud = toPointCloud(message, colored(ColorSource::Rgb8), workers);
    EXPECT_EQ(cloud.value->points.get(), expected);
    ASSERT_EQ(cloud.value->colors.size(), reds.size());
    for (std::size_t i = 0; i < reds.size(); ++i) {
      ASSERT_EQ(cloud.value->colors[i], (render::Rgba{reds[i], 0, 0, 255})) << i;
    }
  }
}

TEST(CloudConversion, readsPackedColorsAsBits) {
  PointCloud2 message = cloudMessage("map", {kThree[0]}, 16);
  message.fields.push_back(field("rgb", 12, PointField::FLOAT32));
  put<std::uint32_t>(message, 12, 0xff8000ffu);  // as a float this is a NaN's neighbor
  auto cloud = toPointCloud(message, colored(ColorSource::Rgb8));
  ASSERT_TRUE(cloud.value) << cloud.reason;
  EXPECT_EQ(cloud.value->colors.at(0), (render::Rgba{128, 0, 255, 255}));
  put<std::uint32_t>(message, 12, 0x7fc01020u);  // a NaN
  cloud = toPointCloud(message, colored(ColorSource::Rgb8));
  EXPECT_EQ(cloud.value->colors.at(0), (render::Rgba{192, 16, 32, 255}));
  message.fields.back().name = "rgba";
  message.fields.back().datatype = PointField::UINT32;
  cloud = toPointCloud(message, colored(ColorSource::Rgb8));
  EXPECT_EQ(cloud.value->colors.at(0).a, 127);
  message.fields.pop_back();
  EXPECT_EQ(reasonFor(message, colored(ColorSource::Rgb8)), "no field 'rgb'");
}

TEST(CloudConversion, colorsByIntensityFromRedToMagenta) {
  PointCloud2 message = cloudMessage("map", kThree, 14);
  message.fields.push_back(field("intensity", 12, PointField::UINT16));
  put<std::uint16_t>(message, 12, 100);
  put<std::uint16_t>(message, 26, 300);
  put<std::uint16_t>(message, 40, 500);
  const auto cloud = toPointCloud(message, colored(ColorSource::Intensity));
  ASSERT_TRUE(cloud.value) << cloud.reason;
  EXPECT_EQ(cloud.value->colors.at(0), (render::Rgba{255, 0, 0, 255}));
  EXPECT_EQ(cloud.value->colors.at(1), (render::Rgba{0, 255, 128, 255}));  // hue 150
  EXPECT_EQ(cloud.value->colors.at(2), (render::Rgba{255, 0, 255, 255}));
  message.fields.back().name = "intensities";
  EXPECT_TRUE(toPointCloud(message, colored(ColorSource::Intensity)).value);
  message.fields.pop_back();
  EXPECT_EQ(reasonFor(message, colored(ColorSource::Intensity)), "no field 'intensity'");
}

TEST(CloudConversion, readsAnyNumberOfAnyFieldAsIntensity) {
  PointCloud2 message = cloudMessage("map", kThree, 14);
  message.fields.push_back(field("ring", 12, PointField::INT16));
  put<std::int16_t>(message, 12, -1);
  put<std::int16_t>(message, 26, 0);
  put<std::int16_t>(message, 40, 1);
  CloudStyle style = colored(ColorSource::Intensity);
  style.channel = "ring";
  EXPECT_EQ(toPointCloud(message, style).value->colors.at(1), (render::Rgba{0, 255, 128, 255}));
  style.channel = "ri\nng";
  EXPECT_EQ(reasonFor(message, style), "no field 'ri?ng'");
  style.channel = "x";  // as in the fast path of plain floats
  EXPECT_EQ(toPointCloud(message, style).value->colors.at(2), (render::Rgba{255, 0, 255, 255}));
}

TEST(CloudConversion, makesGraysOfPackedColorsByTheirLuminance) {
  PointCloud2 message = cloudMessage("map", {kThree[0]}, 16);
  message.fields.push_back(field("rgba", 12, PointField::UINT32));
  put<std::uint32_t>(message, 12, 0x33ff0000u);
  const auto cloud = toPointCloud(message, colored(ColorSource::Mono8));
  ASSERT_TRUE(cloud.value) << cloud.reason;
  EXPECT_EQ(cloud.value->colors.at(0), (render::Rgba{76, 76, 76, 51}));
}

TEST(CloudConversion, readsColorsThatAreThreeFloats) {
  PointCloud2 message = cloudMessage("map", {kThree[0]}, 24);
  message.fields.push_back(field("g", 12, PointField::FLOAT32));
  message.fields.push_back(field("r", 16, PointField::FLOAT32));
  put<float>(message, 12, 0.25f);
  put<float>(message, 16, 7);
  EXPECT_EQ(reasonFor(message, colored(ColorSource::RgbF32)), "no field 'b'");
  message.fields.push_back(field("b", 20, PointField::FLOAT32));
  put<float>(message, 20, std::numeric_limits<float>::quiet_NaN());
  const auto cloud = toPointCloud(message, colored(ColorSource::RgbF32));
  ASSERT_TRUE(cloud.value) << cloud.reason;
  EXPECT_EQ(cloud.value->colors.at(0), (render::Rgba{255, 64, 0, 255}));
}

TEST(CloudConversion, readsBigEndianColors) {
  PointCloud2 message = cloudMessage("map", {{0, 0, 0}}, 16);
  message.fields.push_back(field("rgb", 12, PointField::UINT32));
  message.is_bigendian = 1;
  put<std::uint32_t>(message, 12, 0x0000ff00u);  // 0x00ff0000 the other way around
  EXPECT_EQ(toPointCloud(message, colored(ColorSource::Rgb8)).value->colors.at(0),
            (render::Rgba{255, 0, 0, 255}));
}

}  // namespace
}  // namespace afterglow::nodes::cloud_conversion_test
