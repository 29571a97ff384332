// Messages as bytes over DDS, between two participants of this machine.
#include "nodes/ros2/dds.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <condition_variable>
#include <mutex>
#include <numeric>
#include <stdexcept>

#include "nodes/ros2/dds_service.hpp"
#include "nodes/tools/ros_graph.hpp"

namespace afterglow::nodes::dds_test {
namespace {

constexpr double kPatience_s = 20;
const std::string kTopic = "rt/afterglow_test", kType = "std_msgs::msg::dds_::String_";
const replay::ServiceNames kService = replay::serviceNames("/ask", "std_srvs/srv/Trigger");

/// A domain that other tests on this machine do not use.
replay::Ros2Network ownNetwork(std::uint32_t more = 0) {
  return {100 + (static_cast<std::uint32_t>(getpid()) + more) % 100, false};
}

replay::Bytes message(std::size_t size, std::uint8_t first = 0) {
  replay::Bytes bytes(size);
  std::iota(bytes.begin(), bytes.end(), first);
  bytes[0] = 0;
  bytes[1] = 1;
  return bytes;
}

/// What a reader gets.
class Heard {
 public:
  DdsReader::Take take() {
    return [this](DdsSample&& sample) {
      const std::lock_guard<std::mutex> lock(mutex_);
      samples_.push_back(std::move(sample));
      changed_.notify_all();
    };
  }
  /// So many, once they are there; fewer after a while.
  std::vector<DdsSample> await(std::size_t count) {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait_until(lock, deadlineIn(kPatience_s), [&] { return samples_.size() >= count; });
    return samples_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<DdsSample> samples_;
};

template <typename Side>
bool meets(const Side& side) {
  return waitUntil(deadlineIn(kPatience_s), [&] { return !side.matched().empty(); });
}

class Dds : public ::testing::Test {
 protected:
  DdsParticipant one_{ownNetwork(), "one", {}}, other_{ownNetwork(), "other", {}};
  Heard heard_;
};

TEST_F(Dds, carriesBytesOfAnySizeWithTheirIdentity) {
  DdsReader reader(other_, kTopic, kType, {}, heard_.take());
  DdsWriter writer(one_, kTopic, kType, {});
  ASSERT_TRUE(meets(writer));
  ASSERT_TRUE(meets(reader));
  const std::vector<replay::Bytes> sent = {message(5), message(10'000'000), message(7)};
  std::vector<std::int64_t> sequences;
  for (const replay::Bytes& bytes : sent) sequences.push_back(writer.write(bytes).sequence);
  const std::vector<DdsSample> got = heard_.await(sent.size());
  ASSERT_EQ(got.size(), sent.size());
  for (std::size_t i = 0; i < sent.size(); ++i) {
    EXPECT_TRUE(got[i].cdr == sent[i]) << i;
    EXPECT_TRUE(got[i].writer == writer.guid());
    EXPECT_EQ(got[i].identity.sequence, sequences[i]);
    EXPECT_FALSE(got[i].related.writer.isKnown());
  }
}

TEST_F(Dds, givesWhoComesLateTheLastMessagesOfTransientLocalWriters) {
  DdsWriter writer(one_, kTopic, kType, {true, true, 1});
  writer.write(message(8, 1));
  writer.write(message(9, 2));
  DdsReader reader(other_, kTopic, kType, {true, true, 10}, heard_.take());
  const std::vector<DdsSample> got = heard_.await(1);
  ASSERT_EQ(got.size(), 1U);
  EXPECT_TRUE(got[0].cdr == message(9, 2));
}

TEST_F(Dds, endsAReaderWhileMessagesCome) {
  DdsWriter writer(one_, kTopic, kType, {true, false, 100});
  for (int i = 0; i < 5; ++i) {
    DdsReader reader(other_, kTopic, kType, {}, heard_.take());
    ASSERT_TRUE(meets(writer));
    for (int k = 0; k < 50; ++k) writer.write(message(1000));
  }
}

TEST_F(Dds, refusesASecondTypeOfATopic) {
  const DdsWriter writer(one_, kTopic, kType, {});
  try {
    const DdsReader reader(one_, kTopic, "std_msgs::msg::dds_::Bool_", {}, heard_.take());
    FAIL() << "taken";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(),
                 "DDS refuses rt/afterglow_test as std_msgs::msg::dds_::Bool_: it "
                 "is used as std_msgs::msg::dds_::String_");
  }
}

TEST_F(Dds, doesNotTakeAfterglowsOwnEndpointsForARobots) {
  const DdsWriter writer(one_, kTopic, kType, {});
  const DdsReader reader(other_, kTopic, kType, {}, heard_.take());
  ASSERT_TRUE(meets(writer));
  EXPECT_TRUE(one_.endpoints().empty());
  EXPECT_TRUE(other_.endpoints().empty());
}

TEST_F(Dds, saysWhatDoesNotFit) {
  std::mutex mutex;
  std::string said;
  const auto take = [&](const std::string& topic, const std::string& policy) {
    const std::lock_guard<std::mutex> lock(mutex);
    said = topic + " " + policy;
  };
  DdsParticipant asker(ownNetwork(), "asker", {{}, take});
  const DdsWriter writer(one_, kTopic, kType, {false, false, 1});
  const DdsReader reader(asker, kTopic, kType, {true, false, 1}, heard_.take());
  EXPECT_TRUE(waitUntil(deadlineIn(kPatience_s), [&] {
    const std::lock_guard<std::mutex> lock(mutex);
    return said == "rt/afterglow_test reliability";
  })) << said;
}

TEST_F(Dds, keepsDomainsApart) {
  DdsParticipant elsewhere(ownNetwork(1), "elsewhere", {});
  Heard heard_there;
  const DdsReader there(elsewhere, kTopic, kType, {}, heard_there.take());
  const DdsReader here(other_, kTopic, kType, {}, heard_.take());
  DdsWriter writer(one_, kTopic, kType, {});
  ASSERT_TRUE(meets(here));
  writer.write(message(8));
  EXPECT_EQ(heard_.await(1).size(), 1U);
  EXPECT_TRUE(there.matched().empty());
}

TEST_F(Dds, answersEachClientItsOwnRequests) {
  using Replies = std::vector<std::pair<std::int64_t, replay::Bytes>>;
  std::mutex mutex;
  Replies first, second;
  const auto into = [&mutex](Replies& replies) {
    return [&mutex, &replies](std::int64_t request, replay::Bytes&& cdr) {
      const std::lock_guard<std::mutex> lock(mutex);
      replies.emplace_back(request, std::move(cdr));
    };
  };
  DdsServiceClient one(one_, kService, into(first));
  DdsServiceClient two(other_, kService, into(second));
  EXPECT_FALSE(one.isServed());
  DdsParticipant robot(ownNetwork(), "robot", {});
  DdsServiceServer* answering = nullptr;
  DdsServiceServer server(robot, kService, [&](const SampleIdentity& request, replay::Bytes&& cdr) {
    cdr.push_back(9);
    answering->reply(request, cdr);
  });
  answering = &server;
  ASSERT_TRUE(waitUntil(deadlineIn(kPatience_s), [&] { return one.isServed() && two.isServed(); }));
  const std::int64_t asked_one = one.send(message(8)), asked_two = two.send(message(12));
  ASSERT_TRUE(waitUntil(deadlineIn(kPatience_s), [&] {
    const std::lock_guard<std::mutex> lock(mutex);
    return !first.empty() && !second.empty();
  }));
  const std::lock_guard<std::mutex> lock(mutex);
  ASSERT_EQ(first.size(), 1U);
  ASSERT_EQ(second.size(), 1U);
  EXPECT_EQ(first[0].first, asked_one);
  EXPECT_EQ(second[0].first, asked_two);
  EXPECT_EQ(first[0].second.size(), 9U);
  EXPECT_EQ(second[0].second.size(), 13U);
}

}  // namespace
}  // namespace afterglow::nodes::dds_test
