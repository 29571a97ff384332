#include "nodes/tools/program.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <stdexcept>
#include <string>

namespace afterglow::nodes::program_test {
namespace {

TEST(Program, catchesWhatItPrintsAndHowItEnds) {
  const ProgramResult result = runProgram({"sh", "-c", "echo out; echo err >&2; exit 3"});
  EXPECT_EQ(result.output, "out\nerr\n");
  EXPECT_EQ(result.status, 3);
  EXPECT_EQ(runProgram({"sh", "-c", "kill -TERM $$"}).status, 128 + SIGTERM);
  EXPECT_EQ(runProgram({"cat"}).status, 0) << "there is nothing to read";
}

TEST(Program, hasNoneOfOurDescriptors) {
  constexpr int kOpen = 77;  // as roscpp's sockets are: not close-on-exec
  const int nothing = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
  ASSERT_EQ(::dup2(nothing, kOpen), kOpen);
  const ProgramResult result =
      runProgram({"sh", "-c", "test -e /proc/self/fd/1 && test ! -e /proc/self/fd/77"});
  ::close(kOpen);
  ::close(nothing);
  EXPECT_EQ(result.status, 0);
}

TEST(Program, leadsASessionIfAsked) {
  ProgramStart start;
  start.leader = ProgramStart::Leader::OfSession;
  const pid_t pid = startProgram({"sleep", "1000"}, start);
  EXPECT_EQ(::getsid(pid), pid);
  ::kill(pid, SIGKILL);
  const int status = waitForProgram(pid);
  EXPECT_TRUE(WIFSIGNALED(status));
}

TEST(Program, isNamedIfItCannotBeStarted) {
  try {
    runProgram({"no_such_program"});
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "cannot start no_such_program: No such file or directory");
  }
}

}  // namespace
}  // namespace afterglow::nodes::program_test
