// Each case ends a process of its own.
#include "nodes/tools/stop_signal.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <thread>

namespace afterglow::nodes::stop_signal_test {
namespace {

void raiseLater(int signal) {
  std::this_thread::sleep_for(std::chrono::milliseconds(110));
  std::raise(signal);
}

[[noreturn]] void exitTellingOfTheStop() { _exit(isStopRequested() ? 0 : 1); }

const testing::ExitedWithCode kHeardAStop(0);

TEST(StopSignal, countsOnceWhereItsSenderSendsItTwice) {
  EXPECT_EXIT(
      {
        catchStopSignals();
        std::raise(SIGINT);
        std::raise(SIGINT);
        exitTellingOfTheStop();
      },
      kHeardAStop, "");
}

TEST(StopSignal, endsTheProcessAtOnceWhereItComesAgainLater) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    EXPECT_EXIT(
        {
          catchStopSignals();
          std::raise(signal);
          std::raise(signal);
          catchStopSignals();
          raiseLater(signal);
          exitTellingOfTheStop();
        },
        testing::KilledBySignal(signal), "");
  }
}

TEST(StopSignal, isTheFirstOfItsKindAfterAnother) {
  EXPECT_EXIT(
      {
        catchStopSignals();
        std::raise(SIGINT);
        raiseLater(SIGTERM);
        exitTellingOfTheStop();
      },
      kHeardAStop, "");
}

TEST(StopSignal, isIgnoredWhereItIsToBeHoweverOftenItComes) {
  EXPECT_EXIT(
      {
        catchStopSignals(SecondSignal::IsIgnored);
        std::raise(SIGINT);
        raiseLater(SIGINT);
        exitTellingOfTheStop();
      },
      kHeardAStop, "");
}

TEST(StopSignal, isAFirstOneAgainOnceARequestWasObeyed) {
  EXPECT_EXIT(
      {
        catchStopSignals();
        std::raise(SIGINT);
        forgetStopRequest();
        if (isStopRequested()) _exit(2);
        raiseLater(SIGINT);
        exitTellingOfTheStop();
      },
      kHeardAStop, "");
}

}  // namespace
}  // namespace afterglow::nodes::stop_signal_test
