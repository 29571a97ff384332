// Fast DDS of two versions, 2 (Debian 12) and 3 (Debian 13).
#include "nodes/ros2/dds.hpp"

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#if __has_include(<fastrtps/utils/IPLocator.h>)
#define AFTERGLOW_FAST_DDS 2
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>
#else
#define AFTERGLOW_FAST_DDS 3
#include <fastdds/rtps/common/WriteParams.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.hpp>
#include <fastdds/utils/IPLocator.hpp>
#endif

#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <iterator>
#include <map>
#include <mutex>
#include <set>
#include <stdexcept>
#include <utility>

namespace afterglow::nodes {
namespace {

namespace dds = eprosima::fastdds::dds;
#if AFTERGLOW_FAST_DDS == 2
namespace rtps = eprosima::fastrtps::rtps;
using Code = eprosima::fastrtps::types::ReturnCode_t;
using Duration = eprosima::fastrtps::Duration_t;
const auto kOk = Code::RETCODE_OK;
#else
namespace rtps = eprosima::fastdds::rtps;
using Code = dds::ReturnCode_t;
using Duration = dds::Duration_t;
const auto kOk = dds::RETCODE_OK;
#endif
using Udp = eprosima::fastdds::rtps::UDPv4TransportDescriptor;

constexpr const char* kLoopback = "127.0.0.1";
/// Where participants look for each other, by the standard (DDSI-RTPS 2.5, 9.6.2).
constexpr const char* kMulticast = "239.255.0.1";
constexpr std::uint32_t kFirstPort = 7400, kLastPort = 65535, kDomainPorts = 250;
/// As many participants of a machine are looked for at its loopback: all that have ports.
constexpr std::uint32_t kParticipants = 120;
/// A message of 10 MB is 160 datagrams that come at once. The kernel gives what it allows.
constexpr std::uint32_t kSocketBuffer = 16 << 20;
/// The user data of an endpoint of Afterglow's.
constexpr const char* kOwn = "afterglow=1;";
/// The same if bridges carry it.
constexpr const char* kCarried = "afterglow=carried;";
constexpr const char* kTypeHash = "typehash=";
/// Readers notice that soon that a datagram was lost: what came after it waits for it.
constexpr std::uint32_t kHeartbeat_ns = 20'000'000;
/// A message that was just sent counts as on its way; at once, each would wake a thread of DDS.
constexpr std::uint32_t kSettling_ns = 5'000'000;
/// A writer waits that long for room, in the network or for readers that are behind.
constexpr std::uint32_t kPatience_ns = 20'000'000;
/// Bytes that wait for readers of a writer.
constexpr std::size_t kMostBytes = 256 << 20;

[[noreturn]] void fail(const std::string& what) { throw std::runtime_error("DDS refuses " + what); }

/// Without the right to have such sockets, Fast DDS begins, and meets nobody.
void requireUdp() {
  const int made = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, IPPROTO_UDP);
  if (made < 0) fail("to begin: no UDP socket can be had (" + std::string(strerror(errno)) + ")");
  ::close(made);
}

DdsGuid toGuid(const rtps::GUID_t& guid) {
  DdsGuid result;
  std::copy(std::begin(guid.guidPrefix.value), std::end(guid.guidPrefix.value),
            result.bytes.begin());
  std::copy(std::begin(guid.entityId.value), std::end(guid.entityId.value),
            result.bytes.begin() + sizeof(guid.guidPrefix.value));
  return result;
}

rtps::GUID_t fromGuid(const DdsGuid& guid) {
  rtps::GUID_t result;
  const auto* prefix_end = guid.bytes.data() + sizeof(result.guidPrefix.value);
  std::copy(guid.bytes.data(), prefix_end, std::begin(result.guidPrefix.value));
  std::copy(prefix_end, guid.bytes.data() + guid.bytes.size(), std::begin(result.entityId.value));
  return result;
}

DdsGuid guidOf(const rtps::InstanceHandle_t& handle) {
  DdsGuid result;
  for (std::size_t i = 0; i < result.bytes.size(); ++i) result.bytes[i] = handle.value[i];
  return result;
}

SampleIdentity toIdentity(const rtps::SampleIdentity& identity) {
  const rtps::SequenceNumber_t& number = identity.sequence_number();
  return {toGuid(identity.writer_guid()),
          (static_cast<std::int64_t>(number.high) << 32) | number.low};
}

rtps::SampleIdentity fromIdentity(const SampleIdentity& identity) {
  rtps::SampleIdentity result;
  result.writer_guid(fromGuid(identity.writer));
  result.sequence_number(rtps::SequenceNumber_t(static_cast<std::int32_t>(identity.sequence >> 32),
                                                static_cast<std::uint32_t>(identity.sequence)));
  return result;
}

/// Any type of ROS 2: its messages are replay::Bytes.
class RawType : public dds::TopicDataType {
 public:
#if AFTERGLOW_FAST_DDS == 2
  explicit RawType(const std::string& name) {
    setName(name.c_str());
    m_typeSize = 4;
    auto_fill_type_object(false);
    auto_fill_type_information(false);
  }
  bool serialize(void* data, rtps::SerializedPayload_t* payload) override {
    return write(*static_cast<const replay::Bytes*>(data), *payload);
  }
  bool deserialize(rtps::SerializedPayload_t* payload, void* data) override {
    return read(*payload, *static_cast<replay::Bytes*>(data));
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return sizeOf(data); };
  }
  void* createData() override { return new replay::Bytes(); }
  void deleteData(void* data) override { delete static_cast<replay::Bytes*>(data); }
  bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }
#else
  explicit RawType(const std::string& name) {
    set_name(name);
    max_serialized_type_size = 4;
  }
  bool serialize(const void* const data, rtps::SerializedPayload_t& payload,
                 dds::DataRepresentationId_t) override {
    return write(*static_cast<const replay::Bytes*>(data), payload);
  }
  bool deserialize(rtps::SerializedPayload_t& payload, void* data) override {
    return read(payload, *static_cast<replay::Bytes*>(data));
  }
  std::uint32_t calculate_serialized_size(const void* const data,
                                          dds::DataRepresentationId_t) override {
    return sizeOf(data);
  }
  void* create_data() override { return new replay::Bytes(); }
  void delete_data(void* data) override { delete static_cast<replay::Bytes*>(data); }
  bool compute_key(rtps::SerializedPayload_t&, rtps::InstanceHandle_t&, bool) override {
    return false;
  }
  bool compute_key(const void* const, rtps::InstanceHandle_t&, bool) override { return false; }
#endif

 private:
  static std::uint32_t sizeOf(const void* data) {
    return static_cast<std::uint32_t>(static_cast<const replay::Bytes*>(data)->size());
  }
  static bool write(const replay::Bytes& bytes, rtps::SerializedPayload_t& payload) {
    if (bytes.size() < 4 || bytes.size() > payload.max_size) return false;
    std::memcpy(payload.data, bytes.data(), bytes.size());
    payload.length = static_cast<std::uint32_t>(bytes.size());
    payload.encapsulation = bytes[1] == 0 ? CDR_BE : CDR_LE;
    return true;
  }
  static bool read(const rtps::SerializedPayload_t& payload, replay::Bytes& bytes) {
    bytes.assign(payload.data, payload.data + payload.length);
    return true;
  }
};

template <typename Qos>
void setQos(Qos& qos, const DdsQos& wanted) {
  qos.reliability().kind =
      wanted.is_reliable ? dds::RELIABLE_RELIABILITY_QOS : dds::BEST_EFFORT_RELIABILITY_QOS;
  qos.durability().kind = wanted.is_transient_local ? dds::TRANSIENT_LOCAL_DURABILITY_QOS
                                                    : dds::VOLATILE_DURABILITY_QOS;
  qos.history().kind = wanted.is_counted ? dds::KEEP_ALL_HISTORY_QOS : dds::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = wanted.depth;
  const std::int32_t most = wanted.is_counted ? wanted.depth : std::max(5000, wanted.depth);
  qos.resource_limits().max_samples = most;
  qos.resource_limits().max_samples_per_instance = most;
  qos.resource_limits().allocated_samples = std::min(100, most);
  qos.endpoint().history_memory_policy = rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
  qos.data_sharing().off();
  const std::string own = wanted.is_carried ? kCarried : kOwn;
  qos.user_data().assign(own.begin(), own.end());
}

std::string nameOf(dds::QosPolicyId_t policy) {
  static const std::map<int, const char*> kNames = {
      {dds::DURABILITY_QOS_POLICY_ID, "durability"},
      {dds::DEADLINE_QOS_POLICY_ID, "deadline"},
      {dds::OWNERSHIP_QOS_POLICY_ID, "ownership"},
      {dds::LIVELINESS_QOS_POLICY_ID, "liveliness"},
      {dds::RELIABILITY_QOS_POLICY_ID, "reliability"}};
  const auto found = kNames.find(policy);
  return found == kNames.end() ? "policy " + std::to_string(policy) : found->second;
}

/// The other sides of a reader or a writer.
class MatchedGuids {
 public:
  template <typename Status>
  void take(const DdsGuid& guid, const Status& status) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (status.current_count_change > 0) guids_.insert(guid);
    if (status.current_count_change < 0) guids_.erase(guid);
  }
  std::vector<DdsGuid> all() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return {guids_.begin(), guids_.end()};
  }

 private:
  mutable std::mutex mutex_;
  std::set<DdsGuid> guids_;
};

}  // namespace

bool DdsGuid::isOfParticipant(const DdsGuid& other) const {
  return std::equal(bytes.begin(), bytes.begin() + 12, other.bytes.begin());
}

// ------------------------------------------------------------------------------------ participant
class DdsParticipant::State : public dds::DomainParticipantListener {
 public:
  State(const replay::Ros2Network& network, const std::string& name, Listener listener)
      : listener_(std::move(listener)) {
    requireUdp();
    auto* const factory = dds::DomainParticipantFactory::get_instance();
    participant_ = factory->create_participant(network.domain, qosOf(network, name), this,
                                               dds::StatusMask::none());
    if (!participant_) fail("to begin in domain " + std::to_string(network.domain));
    publisher_ = participant_->create_publisher(dds::PUBLISHER_QOS_DEFAULT);
    subscriber_ = participant_->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT);
    if (!publisher_ || !subscriber_) {
      end();
      fail("a publisher");
    }
  }
  ~State() override { end(); }

  /// The topic of that name, which lives as long as somebody uses it.
  std::shared_ptr<dds::Topic> topic(const std::string& name, const std::string& type) {
    const std::lock_guard<std::mutex> lock(topics_mutex_);
    if (auto known = topics_[name].lock()) {
      if (known->get_type_name() != type) {
        fail(name + " as " + type + ": it is used as " + known->get_type_name());
      }
      return known;
    }
    dds::TypeSupport(new RawType(type)).register_type(participant_, type);
    dds::Topic* const made = participant_->create_topic(name, type, dds::TOPIC_QOS_DEFAULT);
    if (!made) fail("the topic " + name + " of type " + type);
    std::shared_ptr<dds::Topic> topic(made, [this](dds::Topic* unused) {
      const std::lock_guard<std::mutex> deleting(topics_mutex_);
      participant_->delete_topic(unused);
    });
    topics_[name] = topic;
    return topic;
  }

  DdsGuid guid() const { return toGuid(participant_->guid()); }
  dds::Publisher& publisher() { return *publisher_; }
  dds::Subscriber& subscriber() { return *subscriber_; }
  void tellMisfit(const std::string& topic, dds::QosPolicyId_t policy) const {
    if (listener_.on_misfit) listener_.on_misfit(topic, nameOf(policy));
  }
  std::vector<DdsEndpoint> endpoints() const {
    const std::lock_guard<std::mutex> lock(endpoints_mutex_);
    std::vector<DdsEndpoint> all;
    for (const auto& [guid, endpoint] : endpoints_) all.push_back(endpoint);
    std::stable_sort(all.begin(), all.end(),
                     [](const auto& a, const auto& b) { return a.topic < b.topic; });
    return all;
  }

  std::optional<DdsQos> qosOf(const DdsGuid& guid) const {
    const std::lock_guard<std::mutex> lock(endpoints_mutex_);
    const auto found = endpoints_.find(guid);
    if (found == endpoints_.end()) return std::nullopt;
    return found->second.qos;
  }

#if AFTERGLOW_FAST_DDS == 2
  void on_subscriber_discovery(dds::DomainParticipant*,
                               rtps::ReaderDiscoveryInfo&& found) override {
    take(false, found.status == rtps::ReaderDiscoveryInfo::REMOVED_READER, found.info.guid(),
         found.info.topicName().to_string(), found.info.typeName().to_string(),
         found.info.m_qos.m_reliability, found.info.m_qos.m_durability,
         found.info.m_qos.m_userData);
  }
  void on_publisher_discovery(dds::DomainParticipant*, rtps::WriterDiscoveryInfo&& found) override {
    take(true, found.status == rtps::WriterDiscoveryInfo::REMOVED_WRITER, found.info.guid(),
         found.info.topicName().to_string(), found.info.typeName().to_string(),
         found.info.m_qos.m_reliability, found.info.m_qos.m_durability,
         found.info.m_qos.m_userData);
  }
#else
  void on_data_reader_discovery(dds::DomainParticipant*, rtps::ReaderDiscoveryStatus status,
                                const rtps::SubscriptionBuiltinTopicData& found, bool&) override {
    take(false, status == rtps::ReaderDiscoveryStatus::REMOVED_READER, found.guid,
         found.topic_name.to_string(), found.type_name.to_string(), found.reliability,
         found.durability, found.user_data);
  }
  void on_data_writer_discovery(dds::DomainParticipant*, rtps::WriterDiscoveryStatus status,
                                const rtps::PublicationBuiltinTopicData& found, bool&) override {
    take(true, status == rtps::WriterDiscoveryStatus::REMOVED_WRITER, found.guid,
         found.topic_name.to_string(), found.type_name.to_string(), found.reliability,
         found.durability, found.user_data);
  }
#endif

 private:
  static dds::DomainParticipantQos qosOf(const replay::Ros2Network& network,
                                         const std::string& name) {
    dds::DomainParticipantQos qos;
    qos.name(name.c_str());
    // Shared memory is not used: between versions of Fast DDS, users and containers it fails
    // silently.
    const auto udp = std::make_shared<Udp>();
    udp->sendBufferSize = udp->receiveBufferSize = kSocketBuffer;
    qos.transport().use_builtin_transports = false;
    qos.transport().user_transports.push_back(udp);
    auto& builtin = qos.wire_protocol().builtin;
    const std::uint32_t port = kFirstPort + kDomainPorts * network.domain;
    for (std::uint32_t i = 0; i < kParticipants && port + 10 + 2 * i <= kLastPort; ++i) {
      builtin.initialPeersList.push_back(locatorOf(kLoopback, port + 10 + 2 * i));
    }
    if (network.is_subnet) {
      builtin.initialPeersList.push_back(locatorOf(kMulticast, port));
    } else {
      // Nobody is told of it but at this machine's loopback, and nothing is heard but what is sent
      // to it: no multicast. A white list would not do, as nodes that reach for the network tell
      // its address alone.
      builtin.metatrafficUnicastLocatorList.push_back(rtps::Locator_t());
      builtin.discovery_config.ignoreParticipantFlags = rtps::FILTER_DIFFERENT_HOST;
    }
    builtin.readerHistoryMemoryPolicy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    builtin.writerHistoryMemoryPolicy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    return qos;
  }

  static rtps::Locator_t locatorOf(const char* address, std::uint32_t port) {
    rtps::Locator_t locator;
    rtps::IPLocator::setIPv4(locator, address);
    rtps::IPLocator::setPhysicalPort(locator, static_cast<std::uint16_t>(port));
    return locator;
  }

  template <typename Reliability, typename Durability, typename UserData>
  void take(bool is_writer, bool is_gone, const rtps::GUID_t& guid, std::string topic,
            std::string type, const Reliability& reliability, const Durability& durability,
            const UserData& user_data) {
    const std::string told(user_data.begin(), user_data.end());
    if (told.find(kOwn) != std::string::npos) return;
    DdsEndpoint endpoint{toGuid(guid), is_writer, std::move(topic), std::move(type), {}, ""};
    endpoint.qos = {reliability.kind == dds::RELIABLE_RELIABILITY_QOS,
                    durability.kind != dds::VOLATILE_DURABILITY_QOS, 0,
                    told.find(kCarried) != std::string::npos};
    if (const std::size_t at = told.find(kTypeHash); at != std::string::npos) {
      const std::size_t begin = at + std::strlen(kTypeHash);
      endpoint.type_hash = told.substr(begin, told.find(';', begin) - begin);
    }
    {
      const std::lock_guard<std::mutex> lock(endpoints_mutex_);
      if (is_gone) {
        endpoints_.erase(endpoint.guid);
      } else {
        endpoints_[endpoint.guid] = std::move(endpoint);
      }
    }
    if (listener_.on_change) listener_.on_change();
  }

  void end() {
    participant_->set_listener(nullptr);
    participant_->delete_contained_entities();
    dds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }

  const Listener listener_;
  dds::DomainParticipant* participant_ = nullptr;
  dds::Publisher* publisher_ = nullptr;
  dds::Subscriber* subscriber_ = nullptr;
  std::mutex topics_mutex_;
  std::map<std::string, std::weak_ptr<dds::Topic>> topics_;
  mutable std::mutex endpoints_mutex_;
  std::map<DdsGuid, DdsEndpoint> endpoints_;
};

DdsParticipant::DdsParticipant(const replay::Ros2Network& network, const std::string& name,
                               Listener listener)
    : state_(std::make_unique<State>(network, name, std::move(listener))) {}
DdsParticipant::~DdsParticipant() = default;
std::vector<DdsEndpoint> DdsParticipant::endpoints() const { return state_->endpoints(); }
std::optional<DdsQos> DdsParticipant::qosOf(const DdsGuid& guid) const {
  return state_->qosOf(guid);
}
DdsGuid DdsParticipant::guid() const { return state_->guid(); }

// ----------------------------------------------------------------------------------------- writer
class DdsWriter::State : public dds::DataWriterListener {
 public:
  State(DdsParticipant::State& participant, const std::string& name, const std::string& type,
        const DdsQos& wanted)
      : participant_(participant), topic_(participant.topic(name, type)), wanted_(wanted) {
    dds::DataWriterQos qos;
    setQos(qos, wanted);
    // Fast DDS's own thread would spin for as long as a thread that writes does not run.
    qos.publish_mode().kind = dds::SYNCHRONOUS_PUBLISH_MODE;
    qos.reliability().max_blocking_time = Duration(0, kPatience_ns);
    auto& times = qos.reliable_writer_qos().times;
#if AFTERGLOW_FAST_DDS == 2
    times.heartbeatPeriod = Duration(0, kHeartbeat_ns);
    times.nackSupressionDuration = Duration(0, kSettling_ns);
#else
    times.heartbeat_period = Duration(0, kHeartbeat_ns);
    times.nack_supression_duration = Duration(0, kSettling_ns);
#endif
    writer_ = participant_.publisher().create_datawriter(topic_.get(), qos, this);
    if (!writer_) fail("a writer of " + name);
  }
  ~State() override {
    writer_->set_listener(nullptr);
    participant_.publisher().delete_datawriter(writer_);
  }

  SampleIdentity write(const replay::Bytes& cdr, const SampleIdentity& related) {
    rtps::WriteParams parameters;
    if (related.writer.isKnown()) parameters.related_sample_identity(fromIdentity(related));
    if (wanted_.is_counted) makeRoom(cdr.size());
    // Fast DDS does not write through the pointer.
    const auto tryToWrite = [&] {
      return isOk(writer_->write(const_cast<replay::Bytes*>(&cdr), parameters));
    };
    bool is_written = tryToWrite();
    if (!is_written && wanted_.is_counted) {
      giveUp();
      is_written = tryToWrite();
    }
    if (!is_written) fail("a message of " + topic_->get_name());
    return toIdentity(parameters.sample_identity());
  }
  std::uint64_t givenUp() const { return given_up_; }
  DdsGuid guid() const { return toGuid(writer_->guid()); }
  std::vector<DdsGuid> matched() const { return matched_.all(); }

  void on_publication_matched(dds::DataWriter*,
                              const dds::PublicationMatchedStatus& status) override {
    matched_.take(guidOf(status.last_subscription_handle), status);
  }
  void on_offered_incompatible_qos(dds::DataWriter*,
                                   const dds::OfferedIncompatibleQosStatus& status) override {
    participant_.tellMisfit(topic_->get_name(), status.last_policy_id);
  }

 private:
  static bool isOk(bool is_written) { return is_written; }  // version 2
  static bool isOk(const Code& code) { return code == kOk; }

  /// As many messages as may wait are less than kMostBytes, unless they are larger than this.
  bool isLarge(std::size_t size) const { return size > kMostBytes / wanted_.depth; }
  void makeRoom(std::size_t size) {
    if (!isLarge(size)) return;
    const std::lock_guard<std::mutex> lock(room_mutex_);
    if (writer_->wait_for_acknowledgments(Duration(0, 0)) == kOk) waiting_bytes_ = 0;
    waiting_bytes_ += size;
    if (waiting_bytes_ <= kMostBytes) return;
    giveUp();
    waiting_bytes_ = size;
  }
  void giveUp() {
    std::size_t count = 0;
    writer_->clear_history(&count);
    given_up_ += count;
  }

  DdsParticipant::State& participant_;
  const std::shared_ptr<dds::Topic> topic_;
  const DdsQos wanted_;
  std::mutex room_mutex_;
  std::size_t waiting_bytes_ = 0;  ///< of large messages, at most
  std::atomic<std::uint64_t> given_up_{0};
  MatchedGuids matched_;
  dds::DataWriter* writer_ = nullptr;
};

DdsWriter::DdsWriter(DdsParticipant& participant, const std::string& topic, const std::string& type,
                     const DdsQos& qos)
    : state_(std::make_unique<State>(*participant.state_, topic, type, qos)) {}
DdsWriter::~DdsWriter() = default;
SampleIdentity DdsWriter::write(const replay::Bytes& cdr, const SampleIdentity& related) {
  return state_->write(cdr, related);
}
std::uint64_t DdsWriter::givenUp() const { return state_->givenUp(); }
DdsGuid DdsWriter::guid() const { return state_->guid(); }
std::vector<DdsGuid> DdsWriter::matched() const { return state_->matched(); }

// ----------------------------------------------------------------------------------------- reader
class DdsReader::State : public dds::DataReaderListener {
 public:
  State(DdsParticipant::State& participant, const std::string& name, const std::string& type,
        const DdsQos& wanted, Take take)
      : participant_(participant), topic_(participant.topic(name, type)), take_(std::move(take)) {
    dds::DataReaderQos qos;
    setQos(qos, wanted);
    reader_ = participant_.subscriber().create_datareader(topic_.get(), qos, this);
    if (!reader_) fail("a reader of " + name);
  }
  ~State() override {
    reader_->set_listener(nullptr);
    {
      const std::lock_guard<std::mutex> lock(taking_);
      is_ended_ = true;
    }
    participant_.subscriber().delete_datareader(reader_);
  }

  std::uint64_t lost() const { return lost_; }
  DdsGuid guid() const { return toGuid(reader_->guid()); }
  std::vector<DdsGuid> matched() const { return matched_.all(); }

  void on_data_available(dds::DataReader* reader) override {
    const std::lock_guard<std::mutex> lock(taking_);
    for (;;) {
      DdsSample sample;
      dds::SampleInfo info;
      if (is_ended_ || reader->take_next_sample(&sample.cdr, &info) != kOk) return;
      if (!info.valid_data) continue;
      sample.writer = guidOf(info.publication_handle);
      sample.identity = toIdentity(info.sample_identity);
      sample.related = toIdentity(info.related_sample_identity);
      sample.sent = {info.source_timestamp.to_ns()};
      take_(std::move(sample));
    }
  }
  void on_subscription_matched(dds::DataReader*,
                               const dds::SubscriptionMatchedStatus& status) override {
    matched_.take(guidOf(status.last_publication_handle), status);
  }
  void on_sample_lost(dds::DataReader*, const dds::SampleLostStatus& status) override {
    lost_ += static_cast<std::uint64_t>(std::max(0, status.total_count_change));
  }
  void on_requested_incompatible_qos(dds::DataReader*,
                                     const dds::RequestedIncompatibleQosStatus& status) override {
    participant_.tellMisfit(topic_->get_name(), status.last_policy_id);
  }

 private:
  DdsParticipant::State& participant_;
  const std::shared_ptr<dds::Topic> topic_;
  const Take take_;
  std::mutex taking_;
  bool is_ended_ = false;
  std::atomic<std::uint64_t> lost_{0};
  MatchedGuids matched_;
  dds::DataReader* reader_ = nullptr;
};

DdsReader::DdsReader(DdsParticipant& participant, const std::string& topic, const std::string& type,
                     const DdsQos& qos, Take take)
    : state_(std::make_unique<State>(*participant.state_, topic, type, qos, std::move(take))) {}
DdsReader::~DdsReader() = default;
std::uint64_t DdsReader::lost() const { return state_->lost(); }
DdsGuid DdsReader::guid() const { return state_->guid(); }
std::vector<DdsGuid> DdsReader::matched() const { return state_->matched(); }

}  // namespace afterglow::nodes
