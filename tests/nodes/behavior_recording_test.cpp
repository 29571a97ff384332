// Recordings as code makes them, against a recorder in memory.
#include "afterglow/behavior_recording.hpp"

#include <gtest/gtest.h>

#include <optional>
#include <thread>

#include "afterglow/recorded_node.hpp"
#include "tests/support/memory_recorder.hpp"

namespace afterglow::nodes::behavior_recording_test {
namespace {

using test::Calls;
using test::MemoryRecorder;

struct Recorded : testing::Test {
  BehaviorRecording record(const std::string& name, double timeout_s = 20.0, bool wait = true) {
    RecordingOptions options;
    options.name = name;
    options.timeout_s = timeout_s;
    options.wait = wait;
    return BehaviorRecording(options, recorder);
  }
  std::shared_ptr<MemoryRecorder> recorder = std::make_shared<MemoryRecorder>();
};

using RecordingFromCode = Recorded;
using RecordingOfATreeNode = Recorded;

TEST_F(RecordingFromCode, standsFromConstructionToDestruction) {
  {
    const BehaviorRecording recording = record("pick");
    EXPECT_EQ(recorder->calls(), (Calls{"start pick #1"}));
    EXPECT_EQ(recording.id(), 1);
    EXPECT_EQ(recording.problem(), "");
  }
  EXPECT_EQ(recorder->calls(), (Calls{"start pick #1", "stop pick stopped"}));
}

TEST_F(RecordingFromCode, endsOnceWithTheFirstWord) {
  record("a").succeed();
  record("b").fail();
  {
    BehaviorRecording recording = record("c");
    recording.end("aborted");
    recording.succeed();
  }
  EXPECT_EQ(recorder->calls(), (Calls{"start a #1", "stop a success", "start b #1",
                                      "stop b failure", "start c #1", "stop c aborted"}));
}

TEST_F(RecordingFromCode, saysThatAnExceptionEndedIt) {
  try {
    const BehaviorRecording recording = record("pick");
    throw std::runtime_error("dropped");
  } catch (const std::runtime_error&) {
    // In here an exception is over: what is recorded now ends as usual.
    const BehaviorRecording after = record("apologize");
  }
  EXPECT_EQ(recorder->calls(), (Calls{"start pick #1", "stop pick exception", "start apologize #1",
                                      "stop apologize stopped"}));
}

TEST_F(RecordingFromCode, canBeMoved) {
  std::optional<BehaviorRecording> kept;
  {
    BehaviorRecording recording = record("a");
    kept = std::move(recording);
  }
  EXPECT_EQ(recorder->calls().size(), 1U);
  *kept = record("b");
  EXPECT_EQ(recorder->calls(3).back(), "stop a stopped");
  kept.reset();
  EXPECT_EQ(recorder->calls().back(), "stop b stopped");
}

TEST_F(RecordingFromCode, liesBelowTheEnclosingOne) {
  {
    const BehaviorRecording kitting = record("kitting");
    const EnclosingRecording enclosing(kitting);
    const BehaviorRecording pick = record("pick");
    const EnclosingRecording deeper(pick);
    EXPECT_EQ(record("reach").treePath(), "kitting/pick/reach");
  }
  EXPECT_EQ(record("alone").treePath(), "alone");
}

TEST_F(RecordingFromCode, goesOnWithoutARecorder) {
  recorder->leave();
  BehaviorRecording recording = record("pick");
  EXPECT_EQ(recording.problem(), "nobody there");
  EXPECT_TRUE(recording.isDone());
  recording.succeed();
}

TEST_F(RecordingFromCode, throwsWithoutARecorderWhereItIsRequired) {
  RecordingOptions options;
  options.name = "pick";
  options.required = true;
  recorder->refuse("no topics are named");
  try {
    const BehaviorRecording recording(options, recorder);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "'pick' cannot be recorded: no topics are named");
  }
}

TEST_F(RecordingFromCode, waitsNoLongerThanTheTimeoutAndStopsWhatStartsLate) {
  recorder->setOpen(false);
  {
    const BehaviorRecording recording = record("pick", 0.01);
    EXPECT_TRUE(recording.isSettled());
    EXPECT_EQ(recording.problem(), "the recorder does not answer");
    // Nothing further is asked of a recorder that owes an answer.
    const BehaviorRecording next = record("place", 20.0);
    EXPECT_TRUE(next.isDone());
    EXPECT_EQ(next.problem(), "the recorder does not answer");
  }
  recorder->setOpen(true);
  EXPECT_EQ(recorder->calls(2), (Calls{"start pick #1", "stop pick stopped"}));
}

TEST_F(RecordingFromCode, startsOnlyWhenEverythingBeforeIsAnswered) {
  BehaviorRecording first = record("first");
  recorder->setOpen(false);
  first.succeed();
  const BehaviorRecording second = record("second", 20.0, false);
  EXPECT_FALSE(second.isSettled());
  recorder->setOpen(true);
  EXPECT_EQ(recorder->calls(3), (Calls{"start first #1", "stop first success", "start second #1"}));
}

TEST_F(RecordingFromCode, endsAfterThoseBelowIt) {
  BehaviorRecording kitting = record("kitting");
  const EnclosingRecording enclosing(kitting);
  BehaviorRecording pick = record("pick");
  recorder->hold("kitting/pick");
  pick.succeed();
  kitting.succeed();
  for (int i = 0; i < 1000; ++i) std::this_thread::yield();  // time to do it wrong
  recorder->hold("");
  EXPECT_EQ(recorder->calls(4), (Calls{"start kitting #1", "start kitting/pick #1",
                                       "stop kitting/pick success", "stop kitting success"}));
}

TEST_F(RecordingFromCode, isEndedInTheStoreEvenIfItEndsBeforeItStands) {
  recorder->setOpen(false);
  BehaviorRecording recording = record("blink", 20.0, false);
  recording.succeed();
  recorder->setOpen(true);
  EXPECT_EQ(recorder->calls(2), (Calls{"start blink #1", "stop blink success"}));
}

TEST_F(RecordingOfATreeNode, countsAttemptsUntilSuccessHaltOrANewRunAbove) {
  RecordedNode node(recorder);
  const auto attempt = [&](const std::string& outcome) {
    RecordingOptions options;
    options.name = "pick";
    options.attempt = 0;
    node.begin(options);
    node.end(outcome);
  };
  for (const char* outcome : {"failure", "failure", "success", "failure", "halted", "failure"}) {
    attempt(outcome);
  }
  {
    const BehaviorRecording run = record("kitting");
    const EnclosingRecording enclosing(run);
    attempt("failure");
    attempt("failure");
  }
  EXPECT_EQ(recorder->calls(18),
            (Calls{"start pick #1", "stop pick failure", "start pick #2", "stop pick failure",
                   "start pick #3", "stop pick success", "start pick #1", "stop pick failure",
                   "start pick #2", "stop pick halted", "start pick #1", "stop pick failure",
                   "start kitting #1", "start kitting/pick #1", "stop kitting/pick failure",
                   "start kitting/pick #2", "stop kitting/pick failure", "stop kitting stopped"}));
}

TEST_F(RecordingOfATreeNode, neverWaitsForTheRecorder) {
  RecordedNode node(recorder);
  RecordingOptions options;
  options.name = "pick";
  recorder->setOpen(false);
  node.begin(options);
  EXPECT_FALSE(node.mayGo());
  recorder->setOpen(true);
  recorder->calls(1);
  while (!node.mayGo()) std::this_thread::yield();
  recorder->setOpen(false);
  node.end("success");
  EXPECT_FALSE(node.isRunning());
  recorder->setOpen(true);
  EXPECT_EQ(recorder->calls(2).back(), "stop pick success");
}

}  // namespace
}  // namespace afterglow::nodes::behavior_recording_test
