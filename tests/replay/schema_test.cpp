#include "replay/messages/schema.hpp"

#include <gtest/gtest.h>

#include "tests/support/message_definitions.hpp"

namespace afterglow::replay::schema_test {
namespace {

/// The text of the refusal; empty if there is none.
std::string refusal(const std::string& type, const std::string& definition) {
  try {
    Schema::parse(type, definition);
  } catch (const MessageError& error) {
    return error.what();
  }
  return "";
}

const Field& field(const Schema& schema, const std::string& name, std::size_t type = 0) {
  for (const Field& f : schema.types()[type].fields) {
    if (f.name == name) return f;
  }
  throw std::out_of_range(name);
}

TEST(Schema, knowsEveryBuiltinType) {
  const Schema schema = Schema::parse(
      "a/B",
      "bool a\nint8 b\nuint8 c\nint16 d\nuint16 e\nint32 f\nuint32 g\nint64 h\nuint64 i\nfloat32 "
      "j\nfloat64 k\nstring l\ntime m\nduration n\nbyte o\nchar p\n");
  ASSERT_EQ(schema.root().fields.size(), 16u);
  EXPECT_EQ(field(schema, "o").type, FieldType::Int8);
  EXPECT_EQ(field(schema, "p").type, FieldType::UInt8);
  EXPECT_EQ(schema.minimumSize(0), 3u + 4u + 12u + 24u + 4u + 16u + 2u);
  EXPECT_FALSE(schema.isFixedSize(0));
}

TEST(Schema, readsOverCommentsAndConstants) {
  const Schema schema = Schema::parse("a/B",
                                      "# int32 no\n"
                                      "int32 ONE=1\n"
                                      "string HASH = a # b = \"c\"\n"
                                      "float64 PI=3.14 # roughly\n"
                                      "\t uint8  x   # = a comment with an equals sign\r\n"
                                      "\n");
  ASSERT_EQ(schema.root().fields.size(), 1u);
  EXPECT_EQ(schema.root().fields[0].name, "x");
  EXPECT_TRUE(schema.isFixedSize(0));
}

TEST(Schema, resolvesNamesWithinTheirPackage) {
  const Schema schema = Schema::parse("sensor_msgs/PointCloud2", test::kPointCloud2);
  EXPECT_EQ(schema.types()[field(schema, "fields").message].name, "sensor_msgs/PointField");
  EXPECT_EQ(schema.types()[field(schema, "header").message].name, "std_msgs/Header");
  EXPECT_EQ(field(schema, "fields").arity, Field::Arity::DynamicArray);
}

TEST(Schema, knowsTheHeaderThatADefinitionLeavesOut) {
  const Schema schema = Schema::parse("a/B", "Header header\n");
  EXPECT_EQ(schema.types()[1].name, "std_msgs/Header");
  EXPECT_EQ(schema.minimumSize(0), 16u);
  EXPECT_EQ(Schema::parse("a/B", "std_msgs/Header header\n").minimumSize(0), 16u);
}

TEST(Schema, takesTheHeaderOfOldRecordings) {
  const Schema schema =
      Schema::parse("a/B", test::withTypes("Header header\n", "roslib/Header", test::kHeader));
  EXPECT_EQ(schema.types()[1].name, "roslib/Header");
}

TEST(Schema, measuresFixedArrays) {
  const Schema schema =
      Schema::parse("a/B", test::withTypes("P[3] points\nfloat32[2] x\n", "a/P", test::kPoint));
  EXPECT_EQ(schema.minimumSize(0), 3u * 24u + 8u);
  EXPECT_TRUE(schema.isFixedSize(0));
  EXPECT_EQ(field(schema, "points").length, 3u);
}

TEST(Schema, acceptsATypeWithoutFields) {
  EXPECT_EQ(Schema::parse("std_msgs/Empty", "").minimumSize(0), 0u);
  EXPECT_EQ(Schema::parse("std_msgs/Empty", "\n").root().name, "std_msgs/Empty");
}

TEST(Schema, acceptsATypeThatIsDefinedTwiceAlike) {
  const std::string twice =
      test::withTypes("P a\n", "a/P", test::kPoint, "a/P", test::kPoint + "\n");
  EXPECT_EQ(Schema::parse("a/B", twice).minimumSize(0), 24u);
  EXPECT_EQ(refusal("a/B", test::withTypes("P a\n", "a/P", test::kPoint, "a/P", "int8 x\n")),
            "definition of a/B, line 10: a/P is defined twice, differently");
}

TEST(Schema, saysWhereADefinitionIsWrong) {
  const auto expectRefused = [](const std::string& text, const std::string& why) {
    EXPECT_EQ(refusal("a/B", text), "definition of a/B, " + why) << text;
  };
  expectRefused("int32 x\n\nfloat64\n", "line 3: \"float64\" is no field; expected \"type name\"");
  expectRefused("float65 x\n",
                "line 1: field x of a/B is of type a/float65, whose definition is missing");
  expectRefused("int32 x y\n", "line 1: \"x y\" is no name for a field");
  expectRefused("int32 1x\n", "line 1: \"1x\" is no name for a field");
  expectRefused("int-32 x\n", "line 1: \"int-32\" is no type");
  expectRefused("int32 x\nint8 x\n", "line 2: a/B has two fields named x");
  expectRefused("int32[ x\n",
                "line 1: \"int32[\" is no array type; expected type[] or type[length]");
  expectRefused("int32[-1] x\n",
                "line 1: \"int32[-1]\" is no array type; expected type[] or type[length]");
  expectRefused("int32[4294967296] x\n",
                "line 1: \"int32[4294967296]\" is no array type; expected type[] or type[length]");
  expectRefused("time T=1\n", "line 1: a constant cannot be of type time");
  expectRefused("int32 =1\n", "line 1: \"\" is no name for a constant");
  expectRefused("int8 x\n=====\nfloat64 y\n",
                "line 3: expected \"MSG: package/Type\" behind a line of '='");
  expectRefused("int8 x\n=====\nMSG: Y\n",
                "line 3: \"Y\" is no message type; expected package/Type");
  EXPECT_EQ(refusal("String", "string data"),
            "\"String\" is no message type; expected package/Type");
}

TEST(Schema, namesTheLineWithinAContainedType) {
  EXPECT_EQ(
      refusal("a/B", test::withTypes("P p\n", "a/P", "int8 x\nQ q\n")),
      "definition of a/B, line 6: field q of a/P is of type a/Q, whose definition is missing");
}

TEST(Schema, refusesATypeThatContainsItself) {
  EXPECT_EQ(refusal("a/B", "B[] more\n"),
            "definition of a/B, line 1: a/B contains itself, through field more of a/B");
  EXPECT_EQ(refusal("a/B", test::withTypes("C c\n", "a/C", "B b\n")),
            "definition of a/B, line 5: a/B contains itself, through field b of a/C");
}

TEST(Schema, refusesDefinitionsThatWouldTakeStackOrMemory) {
  std::string deep = "T1 x\n";
  std::string wide = "T1 x\nT1 y\n";
  for (int i = 1; i < 300; ++i) {
    const std::string type = "a/T" + std::to_string(i), next = "T" + std::to_string(i + 1);
    deep = test::withTypes(deep, type, next + " x\n");
    wide = test::withTypes(wide, type, i < 40 ? next + " x\n" + next + " y\n" : "int8 x\n");
  }
  deep = test::withTypes(deep, "a/T300", "int8 x\n");
  EXPECT_NE(refusal("a/B", deep).find("nested more than 64 deep"), std::string::npos);
  EXPECT_NE(refusal("a/B", wide).find("more than 8192 fields in all"), std::string::npos);
  std::string empty, long_paths = test::withTypes("T1 x\n");
  for (int i = 0; i < 65; ++i) empty += "uint8[0] x" + std::to_string(i) + "\n";
  EXPECT_NE(refusal("a/B", empty).find("more than 64 fields that take no bytes"),
            std::string::npos);
  const std::string name(100'000, 'x');
  for (int i = 1; i < 60; ++i) {
    long_paths = test::withTypes(long_paths, "a/T" + std::to_string(i),
                                 i < 59 ? "T" + std::to_string(i + 1) + " " + name + "\n"
                                        : "int8 x\n");
  }
  EXPECT_NE(refusal("a/B", long_paths).find("letters in the paths of its fields"),
            std::string::npos);
}

TEST(Schema, knowsThatWhatTakesNoBytesHasAFixedSize) {
  const std::string fields = "E[4000000000] x\nstring[0] y\n";
  const Schema schema = Schema::parse("a/B", test::withTypes(fields, "a/E", "string[0] z\n"));
  EXPECT_EQ(schema.minimumSize(0), 0u);
  EXPECT_TRUE(schema.isFixedSize(0));
}

TEST(Schema, saturatesSizesBeyondAllNumbers) {
  const auto minimumSize = [](const std::string& fields) {
    return Schema::parse("a/B", test::withTypes(fields, "a/C", "D[4294967295] d\n", "a/D",
                                                "int64[4294967295] x\n"))
        .minimumSize(0);
  };
  EXPECT_GT(minimumSize("C[4294967295] c\n"), std::size_t{1} << 62);
  EXPECT_GT(minimumSize("int8[2] a\nC b\nC c\n"), std::size_t{1} << 62);
}

}  // namespace
}  // namespace afterglow::replay::schema_test
