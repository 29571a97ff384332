/// \file
/// Plays a scene again and again, while each time another call of the system fails.
#pragma once

#include <dlfcn.h>
#include <execinfo.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <sstream>

#include "tests/support/store_scenes.hpp"
#include "tests/support/system_calls.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::test {

constexpr unsigned kLongest_s = 30;

/// How many of a scene's calls fail; $AFTERGLOW_TEST_FAULTS says more.
inline long failuresOfAScene() {
  const char* asked = std::getenv("AFTERGLOW_TEST_FAULTS");
  return asked ? std::atol(asked) : 15;
}

/// A kind of calls, and how one of them fails.
struct CallFault {
  std::string name;
  CallKind kind;
  int error;
};
inline const std::vector<CallFault> kOfTheDisk = {{"no space", CallKind::Write, ENOSPC},
                                                  {"a write error", CallKind::Write, EIO},
                                                  {"a sync error", CallKind::Sync, EIO}};
inline const std::vector<CallFault> kOfMemory = {{"no memory", CallKind::Memory, ENOMEM}};

/// Tells its parent, without memory of its own.
class TellingChild : public Witness {
 public:
  explicit TellingChild(int to) : to_(to) {}
  void onKept(const Kept& kept) override {
    std::string line = "kept";
    for (const auto& [key, promise] : kept.behaviors) {
      line += " " + key + (promise.has_ended ? " 1 " : " 0 ") + std::to_string(promise.messages);
    }
    tell(line);
  }
  void onError(const std::string& text) override { tell("error " + text); }

 private:
  void tell(const std::string& line) const {
    const std::string text = std::to_string(line.size()) + "\n" + line;
    if (::write(to_, text.data(), text.size()) < 0) std::_Exit(3);
  }
  const int to_;
};

/// What a child told, to its end.
struct Told {
  Kept kept;
  std::vector<std::string> errors;
  int status = 0;
};

inline Told parse(const std::string& text) {
  Told told;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t begin = text.find('\n', at) + 1;
    const std::string line = text.substr(begin, std::stoul(text.substr(at)));
    at = begin + line.size();
    std::istringstream words(line);
    std::string word, key;
    words >> word;
    if (word == "error") told.errors.push_back(line.substr(6));
    if (word != "kept") continue;
    told.kept = {};
    Kept::Promise promise;
    while (words >> key >> promise.has_ended >> promise.messages) {
      told.kept.behaviors[key] = promise;
    }
  }
  return told;
}

/// The status of a program that nlohmann-json ended: its values take memory when they go.
constexpr int kEndedByJson = 42;

inline void onAbort(int) {
  std::array<void*, 64> frames{};
  const int count = backtrace(frames.data(), static_cast<int>(frames.size()));
  for (int i = 0; i < count; ++i) {
    Dl_info info{};
    const bool is_known = dladdr(frames[static_cast<std::size_t>(i)], &info) != 0 && info.dli_sname;
    if (is_known && std::strstr(info.dli_sname, "nlohmann")) std::_Exit(kEndedByJson);
  }
  backtrace_symbols_fd(frames.data(), count, STDERR_FILENO);
  signal(SIGABRT, SIG_DFL);
}

inline Told playInChild(const Scene& scene, const std::string& folder, const CallFault& fault,
                        long n) {
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0) throw std::runtime_error("no pipe");
  const pid_t child = fork();
  if (child == 0) {
    close(ends[0]);
    alarm(kLongest_s);  // hangs
    signal(SIGABRT, onAbort);
    TellingChild witness(ends[1]);
    // What is thrown here is the scene's own, between what it attempts.
    witness.attempt([&] {
      countCalls(fault.kind, n, fault.error);
      scene(folder, witness);
      countedCalls();
    });
    std::_Exit(0);
  }
  close(ends[1]);
  std::string text;
  std::array<char, 4096> buffer{};
  for (ssize_t size; (size = read(ends[0], buffer.data(), buffer.size())) > 0;) {
    text.append(buffer.data(), static_cast<std::size_t>(size));
  }
  close(ends[0]);
  Told told = parse(text);
  waitpid(child, &told.status, 0);
  return told;
}

inline std::vector<std::string> faultsOf(const Told& told, const std::string& folder) {
  std::vector<std::string> faults = faultsIn(folder, told.kept);
  if (WIFSIGNALED(told.status)) {
    faults.push_back(std::string("it was ended: ") + strsignal(WTERMSIG(told.status)));
  }
  for (const std::string& error : told.errors) {
    const bool is_line = !error.empty() && error.find('\n') == std::string::npos;
    if (!is_line || error.find("bad_alloc") != std::string::npos) {
      faults.push_back("unclear: \"" + error + "\"");
    }
  }
  return faults;
}

inline long callsOf(const Scene& scene, const CallFault& fault) {
  const TempFolder folder;
  class Quiet : public Witness {
    void onKept(const Kept&) override {}
    void onError(const std::string& text) override { throw std::runtime_error(text); }
  } quiet;
  countCalls(fault.kind);
  scene(folder.path(""), quiet);
  return countedCalls();
}

/// Fails calls of a scene, each in turn, in a process of its own. It must neither crash nor hang;
/// it tells it in one line, and has lost nothing that it had acknowledged; the store is sound and
/// takes more afterwards.
inline void expectNothingLost(const Scene& scene, const std::vector<CallFault>& faults) {
  for (const CallFault& fault : faults) {
    const long calls = callsOf(scene, fault);
    ASSERT_GT(calls, 10);
    const long stride = std::max(1L, calls / failuresOfAScene());
    long failures = 0, by_json = 0;
    for (long n = 1; n <= calls; n += stride, ++failures) {
      const TempFolder folder;
      const Told told = playInChild(scene, folder.path(""), fault, n);
      by_json += WIFEXITED(told.status) && WEXITSTATUS(told.status) == kEndedByJson ? 1 : 0;
      EXPECT_EQ(faultsOf(told, folder.path("")), std::vector<std::string>{})
          << fault.name << " in call " << n << " of " << calls;
    }
    std::printf("%s: %ld of %ld calls failed", fault.name.c_str(), failures, calls);
    if (by_json > 0) std::printf(", in %ld nlohmann-json ended the program", by_json);
    std::printf("\n");
  }
}

}  // namespace afterglow::test
