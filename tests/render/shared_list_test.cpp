#include "render/scene/scene.hpp"

#include <gtest/gtest.h>

#include <string>

namespace afterglow::render::shared_list_test {
namespace {

using Words = SharedList<std::string>;

TEST(SharedList, sharesItsElementsWithItsCopies) {
  const Words words = {"a", "b"};
  const Words copy = words;
  EXPECT_EQ(&copy[0], &words[0]);
  EXPECT_EQ(copy.size(), 2u);
  EXPECT_EQ(copy.back(), "b");
}

TEST(SharedList, changesItsOwnCopyAlone) {
  Words words = {"a"};
  const Words before = words;
  words.push_back("b");
  words.edit()[0] = "c";
  EXPECT_EQ(before, (Words{"a"}));
  EXPECT_EQ(words, (Words{"c", "b"}));
}

TEST(SharedList, withoutElementsIsAnEmptyList) {
  Words words;
  EXPECT_TRUE(words.empty());
  EXPECT_EQ(words.begin(), words.end());
  EXPECT_EQ(words, Words(std::vector<std::string>()));
  words.emplace_back(3, 'x');
  EXPECT_EQ(words.at(0), "xxx");
}

TEST(SharedList, takesAVectorWithoutCopyingIt) {
  std::vector<std::string> vector = {"a", "b"};
  const std::string* first = vector.data();
  const Words words = std::move(vector);
  EXPECT_EQ(&words.front(), first);
}

}  // namespace
}  // namespace afterglow::render::shared_list_test
