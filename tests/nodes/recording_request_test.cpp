#include "nodes/recorder/recording_request.hpp"

#include <afterglow/RecordBehaviorGoal.h>
#include <afterglow/StartRecording.h>
#include <gtest/gtest.h>

#include <set>
#include <stdexcept>
#include <string>

namespace afterglow::nodes::recording_request_test {
namespace {

RecordingOptions everything() {
  RecordingOptions asked;
  asked.name = "pick";
  asked.topics = {"/a"};
  asked.regexes = {"/b.*"};
  asked.all = true;
  asked.exclude = {"/c"};
  asked.limits = {"/a every=5"};
  asked.tree_path = "kitting/pick";
  asked.parameters = R"({"object": "gear"})";
  asked.tags = {"demo"};
  asked.attempt = 3;
  asked.pre_roll_s = 1.5;
  asked.keep_if = "failure";
  return asked;
}

std::string refusal(const RecordingOptions& asked) {
  try {
    checkedRequest(asked);
    return "";
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
}

template <typename Message>
void expectFieldsSurvive() {
  Message message;
  const RecordingOptions asked = everything();
  copyRecordingFields(asked, message);
  RecordingOptions copy;
  copyRecordingFields(message, copy);
  std::set<std::string> names;
  visitRecordingFields(
      [&](const RecordingField& field, const auto& before, const auto& after) {
        EXPECT_EQ(before, after) << field.name;
        EXPECT_TRUE(names.insert(field.name).second) << field.name;
      },
      asked, copy);
  EXPECT_EQ(names.size(), 12u);
}

TEST(RecordingFields, areThoseOfTheActionAndOfTheService) {
  expectFieldsSurvive<RecordBehaviorGoal>();
  expectFieldsSurvive<StartRecording::Request>();
}

TEST(RecordingRequest, isWhatItsFieldsSay) {
  const RecordingRequest request = checkedRequest(everything());
  EXPECT_EQ(request.behavior.name, "pick");
  EXPECT_EQ(request.behavior.attempt, 3);
  EXPECT_TRUE(request.choice.isOpen());
  EXPECT_EQ(request.terms.limits.size(), 1u);
  EXPECT_EQ(request.terms.pre_roll_ns, 1'500'000'000);
  EXPECT_EQ(request.keep_if, std::set<std::string>{"failure"});
}

TEST(RecordingRequest, isRefusedInOneLine) {
  RecordingOptions asked = everything();
  asked.pre_roll_s = 3601;
  EXPECT_EQ(refusal(asked), "pre_roll must be 0 to 3600 seconds");
  asked = RecordingOptions();
  EXPECT_EQ(refusal(asked), "name is empty: a behavior is found by its name");
  asked.name = "pick";
  EXPECT_EQ(refusal(asked), "no topics are named");
  asked.topics = {"relative"};
  EXPECT_EQ(refusal(asked), "'relative' is no topic: it begins with no slash");
  asked.topics = {"//joy"};
  EXPECT_EQ(refusal(asked), "'//joy' is no clean name: '/joy' is");
  asked.topics = {"/a"};
  EXPECT_EQ(refusal(asked), "");
}

}  // namespace
}  // namespace afterglow::nodes::recording_request_test
