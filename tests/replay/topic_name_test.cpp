#include "replay/messages/topic_name.hpp"

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

namespace afterglow::replay::topic_name_test {
namespace {

std::string refusalOf(const std::string& text) {
  try {
    (void)TopicName(text);
    return "";
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
}

TEST(TopicName, isWhatRosCallsATopic) {
  for (const char* text : {"/joy", "/robot1/base_scan", "/2nd", "/_hidden/A9"}) {
    EXPECT_EQ(TopicName(text).text(), text);
  }
}

TEST(TopicName, refusesWhatIsNotCleanWithBothForms) {
  EXPECT_EQ(refusalOf("//joy"), "'//joy' is no clean name: '/joy' is");
  EXPECT_EQ(refusalOf("/base//command/"), "'/base//command/' is no clean name: '/base/command' is");
}

TEST(TopicName, refusesWhatIsNone) {
  EXPECT_EQ(refusalOf(""), "'' is no topic: it begins with no slash");
  EXPECT_EQ(refusalOf("joy"), "'joy' is no topic: it begins with no slash");
  EXPECT_EQ(refusalOf("~joy"), "'~joy' is no topic: it begins with no slash");
  EXPECT_EQ(refusalOf("//"), "'//' is no topic: a slash is no name");
  EXPECT_EQ(refusalOf("/a-b"), "'/a-b' is no topic: '-' is none of a-z, A-Z, 0-9, _ and /");
  EXPECT_EQ(refusalOf("/a\n"),
            "'/a\n' is no topic: a letter in it is none of a-z, A-Z, 0-9, _ and /");
  EXPECT_EQ(refusalOf("/" + std::string(255, 'a')).substr(250),
            "aaaaaa' is no topic: it has 256 letters, of 255");
  EXPECT_EQ(refusalOf("/" + std::string(254, 'a')), "");
}

TEST(TopicName, ofARecordingIsItsCleanForm) {
  EXPECT_EQ(TopicName::cleaned("/base_controller//command"), TopicName("/base_controller/command"));
  EXPECT_FALSE(TopicName::cleaned("joy"));
  EXPECT_FALSE(TopicName::cleaned("/caf\xc3\xa9"));
  EXPECT_FALSE(TopicName::cleaned("///"));
}

TEST(TopicName, liesInANamespace) {
  EXPECT_EQ(TopicName("/odom").in("/robot1"), TopicName("/robot1/odom"));
  EXPECT_EQ(TopicName("/odom").in("/"), TopicName("/odom"));
  EXPECT_EQ(TopicName("/odom").in(""), TopicName("/odom"));
  EXPECT_THROW((void)TopicName("/odom").in("robot1"), std::invalid_argument);
  EXPECT_THROW((void)TopicName("/odom").in("/" + std::string(251, 'a')), std::invalid_argument);
}

TEST(TopicName, ofANamespaceIsMoreThanASlash) {
  EXPECT_NO_THROW(checkNamespace(""));
  EXPECT_NO_THROW(checkNamespace("/robot1"));
  for (const char* text : {"/", "robot1", "/robot1/"}) {
    EXPECT_THROW(checkNamespace(text), std::invalid_argument) << text;
  }
}

}  // namespace
}  // namespace afterglow::replay::topic_name_test
