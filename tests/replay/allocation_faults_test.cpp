// Memory that ends at every moment of what reads from elsewhere and of what writes a store: an
// error each time, nothing half done, and all is well when there is memory again. This program's
// operator new fails when it is told to. What makes JSON is left out: values of nlohmann-json take
// memory when they end, and a program ends that has none for them then.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <exception>
#include <memory>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include "replay/bags/bag_file.hpp"
#include "replay/bags/bag_reader.hpp"
#include "replay/messages/document.hpp"
#include "replay/messages/schema.hpp"
#include "replay/record/recorder.hpp"
#include "replay/store/open/open_store.hpp"
#include "tests/support/message_definitions.hpp"
#include "tests/support/store_samples.hpp"
#include "tests/support/temp_folder.hpp"

namespace {
thread_local long allocations_left = -1;  // negative: without end
thread_local bool has_allocation_failed = false;
}  // namespace

// Not inlined, or the compiler takes malloc and delete for a pair that do not match.
[[gnu::noinline]] void* operator new(std::size_t size) {
  if (void* memory = operator new(size, std::nothrow)) return memory;
  throw std::bad_alloc();
}
// A sanitizer has one of its own otherwise, which wants its own delete.
[[gnu::noinline]] void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  const bool fails = allocations_left == 0;
  if (allocations_left >= 0 && !fails) --allocations_left;
  if (void* memory = fails ? nullptr : std::malloc(size > 0 ? size : 1)) return memory;
  has_allocation_failed = true;
  return nullptr;
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace afterglow::replay::allocation_faults_test {
namespace {

using namespace afterglow::test;

constexpr long kMost = 100'000;

/// Ends the shortage, also where it is thrown through.
struct Shortage {
  explicit Shortage(long left) {
    has_allocation_failed = false;
    allocations_left = left;
  }
  ~Shortage() { allocations_left = -1; }
};

/// Does it with memory for 0, 1, 2... allocations, each time on what `make` gives, until there is
/// enough. `check` sees what is left after each shortage.
template <typename Make, typename Do, typename Check>
void expectErrorsOnly(const Make& make, const Do& doIt, const Check& check) {
  long failures = 0;
  for (long left = 0; left < kMost; ++left) {
    auto made = make();
    bool is_done = false;
    try {
      const Shortage shortage(left);
      doIt(made);
      is_done = true;
    } catch (const std::exception&) {  // std::bad_alloc, or what was made of it
      ++failures;
    }
    check(made, is_done);
    if (is_done && !has_allocation_failed) {
      EXPECT_GT(failures, 0) << "nothing is allocated";
      return;
    }
  }
  FAIL() << "never enough";
}

struct Nothing {};
Nothing nothing() { return {}; }
const auto kUnseen = [](const Nothing&, bool) {};

const char kDefinition[] =
    "Header header\nstring[] name\nfloat64[] position\n"
    "================================================================================\n"
    "MSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n";

Bytes jointBytes() {
  Bytes bytes(12, 0);
  const auto addText = [&](const std::string& text) {
    const Bytes packed = stringBytes(text);
    bytes.insert(bytes.end(), packed.begin(), packed.end());
  };
  addText("base_link_of_the_robot_in_the_kitchen");
  for (const std::uint8_t byte : {2, 0, 0, 0}) bytes.push_back(byte);
  addText("shoulder_pan_joint_of_the_left_arm");
  addText("elbow");
  for (const std::uint8_t byte : {1, 0, 0, 0}) bytes.push_back(byte);
  bytes.insert(bytes.end(), 8, 0);
  return bytes;
}

TEST(AllocationFaults, ofADefinitionAreErrors) {
  expectErrorsOnly(
      nothing, [](Nothing&) { Schema::parse("sensor_msgs/JointState", kDefinition); }, kUnseen);
}

TEST(AllocationFaults, ofAMessageThatIsReadAreErrors) {
  const Schema schema = Schema::parse("sensor_msgs/JointState", kDefinition);
  const Bytes bytes = jointBytes();
  expectErrorsOnly(nothing, [&](Nothing&) { decode(schema, bytes); }, kUnseen);
}

/// A store of one behavior with ten messages.
struct Written {
  std::unique_ptr<Store> store;
  std::int64_t channel = 0;
  Behavior behavior;

  explicit Written(std::unique_ptr<Store> empty = openMemoryStore()) : store(std::move(empty)) {
    const auto recording = store->addRecording({0, "", "x", ""});
    channel = store->addChannel(recording, stringChannel("/a"));
    behavior = sampleBehavior(recording, {"/a"}, 0, 1000);
    behavior.id = store->addBehavior(behavior);
    store->append(batchFrom(0));
  }
  std::vector<Message> batchFrom(std::uint64_t first) const {
    std::vector<Message> batch;
    for (std::uint64_t i = first; i < first + 10; ++i) {
      batch.push_back(stringMessage(channel, static_cast<std::int64_t>(i) + 1, i, "text"));
    }
    return batch;
  }
  std::size_t count() const { return readTexts(*store, behavior).size(); }
};

TEST(AllocationFaults, ofAppendedMessagesLeaveAllOfThemOrNone) {
  expectErrorsOnly([] { return Written(); },
                   [](Written& written) {
                     const auto batch = written.batchFrom(10);
                     written.store->append(batch);
                   },
                   [](const Written& written, bool is_done) {
                     const std::size_t count = written.count();
                     EXPECT_TRUE(count == 20 || (count == 10 && !is_done)) << count;
                   });
}

TEST(AllocationFaults, ofAReadStoreAreErrorsAndItIsReadAgain) {
  const Written written;
  expectErrorsOnly([&] { return written.store->messages(written.behavior, {}); },
                   [](const std::unique_ptr<MessageCursor>& cursor) { readAll(*cursor); },
                   [&](const auto&, bool) { EXPECT_EQ(written.count(), 10u); });
}

/// What the queue allocates is not for each message.
TEST(AllocationFaults, ofOfferedMessagesCountAsDroppedAndTheBehaviorEnds) {
  constexpr std::uint64_t kMessages = 12;
  const auto store = openMemoryStore();
  Recorder recorder(*store, RecorderOptions());
  const auto channel = recorder.channelIndex(stringChannel("/a"));
  const auto behavior = recorder.begin(sampleBehavior(0, {"/a"}, 1, 2)).id;
  for (std::uint64_t i = 0; i < kMessages; ++i) {
    Bytes bytes = stringBytes("text");
    try {
      const Shortage shortage(0);
      recorder.offer(channel, {2 + static_cast<std::int64_t>(i)}, std::move(bytes));
    } catch (const std::bad_alloc&) {  // there is none even for the reason
    }
  }
  const auto counts = recorder.end(behavior, {100}, outcome("success"));
  EXPECT_GT(recorder.load().dropped, 0u);
  EXPECT_EQ(counts.stored + recorder.load().dropped, kMessages);
}

TEST(AllocationFaults, ofABagThatIsReadAreErrors) {
  const Written written;
  const TempFolder folder;
  const std::string path = folder.path("ten.bag");
  exportBags(*written.store, {written.behavior}, {}, path);
  std::size_t read = 0;
  expectErrorsOnly(
      nothing,
      [&](Nothing&) {
        read = 0;
        BagReader bag(path);
        for (const BagReader::Entry& entry : bag.entries())
          read += bag.message(entry).empty() ? 0 : 1;
      },
      kUnseen);
  EXPECT_EQ(read, 10u);
}

TEST(AllocationFaults, ofDescriptorsAreErrors) {
  const TempFolder folder;
  const std::string path = folder.path("store.db");
  const Written written(openStore(path, OpenMode::Record));
  std::vector<int> used;
  rlimit before{};
  getrlimit(RLIMIT_NOFILE, &before);
  rlimit few = before;
  few.rlim_cur = std::min<rlim_t>(before.rlim_cur, 256);
  setrlimit(RLIMIT_NOFILE, &few);
  for (int fd; (fd = open("/dev/null", O_RDONLY)) >= 0;) used.push_back(fd);
  std::exception_ptr failure;  // looked at later: sanitizers need descriptors, too
  try {
    openStore(path, OpenMode::ReadOnly);
  } catch (...) {
    failure = std::current_exception();
  }
  for (const int fd : used) close(fd);
  setrlimit(RLIMIT_NOFILE, &before);
  ASSERT_TRUE(failure);
  std::string why;
  try {
    std::rethrow_exception(failure);
  } catch (const StoreError& error) {
    why = error.what();
  }
  EXPECT_NE(why.find(path), std::string::npos) << why;
  EXPECT_EQ(readTexts(*openStore(path, OpenMode::ReadOnly), written.behavior).size(), 10u);
}

}  // namespace
}  // namespace afterglow::replay::allocation_faults_test
