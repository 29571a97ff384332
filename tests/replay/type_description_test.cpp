// What nodes of ROS 2 tell of their types.
#include "replay/ros2/type_description.hpp"

#include <gtest/gtest.h>

#include "replay/ros2/ros2_definition.hpp"
#include "tests/support/cdr_bytes.hpp"

namespace afterglow::replay::type_description_test {
namespace {

using Cdr = test::CdrBytes;
using test::messageErrorOf;

struct Field {
  std::string name;
  std::uint8_t type;
  std::uint64_t capacity = 0, string_capacity = 0;
  std::string nested = {};
};

void putType(Cdr& cdr, const std::string& name, const std::vector<Field>& fields) {
  cdr.text(name).put(static_cast<std::uint32_t>(fields.size()));
  for (const Field& field : fields) {
    cdr.text(field.name).put(field.type).put(field.capacity).put(field.string_capacity);
    cdr.text(field.nested).text("");
  }
}

/// A reply that describes a/msg/All, which contains a/msg/Part; with a file for the latter.
Cdr reply(const std::vector<Field>& fields, const std::string& encoding = "msg") {
  Cdr cdr;
  cdr.put(std::uint8_t{1}).text("");
  putType(cdr, "a/msg/All", fields);
  cdr.put(std::uint32_t{1});
  putType(cdr, "a/msg/Part", {{"w", 11}});
  cdr.put(std::uint32_t{1}).text("a/msg/Part").text(encoding).text("int8 ODD=1\nfloat64 w 1.5");
  cdr.put(std::uint32_t{0});
  return cdr;
}

TEST(TypeDescription, isAskedForByNameAndHash) {
  EXPECT_EQ(typeDescriptionRequest("std_msgs/msg/String", "RIHS01_ab"),
            static_cast<const Bytes&>(
                Cdr(false, 0).text("std_msgs/msg/String").text("RIHS01_ab").put(std::uint8_t{1})));
}

TEST(TypeDescription, isOfTheFieldsOrThePackagesFile) {
  const std::string rule = std::string(80, '=') + "\nMSG: a/msg/Part\n";
  const std::vector<Field> fields = {{"flag", 15},
                                     {"name", 21, 0, 10},
                                     {"numbers", 6 + 48, 3},
                                     {"few", 10 + 96, 5},
                                     {"parts", 1 + 144, 0, 0, "a/msg/Part"},
                                     {"letter", 13}};
  const std::string lines =
      "bool flag\nstring<=10 name\nint32[3] numbers\nfloat32[<=5] few\na/msg/Part[] parts\n"
      "uint8 letter\n";
  EXPECT_EQ(definitionIn(reply(fields)), lines + rule + "int8 ODD=1\nfloat64 w 1.5\n");
  EXPECT_EQ(definitionIn(reply(fields, "idl")), lines + rule + "float64 w\n");
  EXPECT_EQ(ros1Definition("a/msg/All", definitionIn(reply(fields))),
            "bool flag\nstring name\nint32[3] numbers\nfloat32[] few\na/Part[] parts\n"
            "uint8 letter\n" +
                std::string(80, '=') + "\nMSG: a/Part\nint8 ODD=1\nfloat64 w\n");
}

TEST(TypeDescription, saysWhyThereIsNone) {
  Cdr refused;
  refused.put(std::uint8_t{0}).text("no such type");
  putType(refused, "", {});
  refused.put(std::uint32_t{0}).put(std::uint32_t{0}).put(std::uint32_t{0});
  EXPECT_EQ(messageErrorOf([&] { definitionIn(refused); }), "no such type");
  EXPECT_EQ(messageErrorOf([&] {
              definitionIn(reply({{"far", 12}}));
            }),
            "field far has type 12, which messages have not");
  EXPECT_EQ(messageErrorOf([&] {
              definitionIn(reply({{"far", 255}}));
            }),
            "field far has type 255, which messages have not");
}

TEST(TypeDescription, isNotReadFromOtherBytes) {
  const Bytes whole = reply({{"flag", 15}});
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const Bytes cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_NE(messageErrorOf([&] { definitionIn(cut); }), "") << size;
  }
}

}  // namespace
}  // namespace afterglow::replay::type_description_test
