#include "nodes/ros2/dds_service.hpp"

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

namespace afterglow::nodes {
namespace {

/// As rmw_fastrtps waits for a client whose reader it has not met.
constexpr auto kClientPatience = std::chrono::milliseconds(100);
constexpr auto kClientLook = std::chrono::milliseconds(2);

const DdsQos kServices{true, false, 10};

}  // namespace

DdsServiceClient::DdsServiceClient(DdsParticipant& participant, const replay::ServiceNames& names,
                                   OnReply on_reply)
    : on_reply_(std::move(on_reply)),
      requests_(participant, names.request_topic, names.request_type, kServices),
      replies_(participant, names.reply_topic, names.reply_type, kServices,
               [this, own = requests_.guid()](DdsSample&& reply) {
                 // Others' replies come here, too. Both of a client's GUIDs are its name.
                 const DdsGuid& client = reply.related.writer;
                 if (!is_complete_ || (client != own && client != replies_.guid())) return;
                 on_reply_(reply.related.sequence, std::move(reply.cdr));
               }) {
  is_complete_ = true;
}

bool DdsServiceClient::isServed() const {
  const std::vector<DdsGuid> readers = requests_.matched(), writers = replies_.matched();
  return std::any_of(readers.begin(), readers.end(), [&](const DdsGuid& reader) {
    return std::any_of(writers.begin(), writers.end(),
                       [&](const DdsGuid& writer) { return writer.isOfParticipant(reader); });
  });
}

std::int64_t DdsServiceClient::send(const replay::Bytes& cdr) {
  return requests_.write(cdr, {replies_.guid(), 0}).sequence;
}

DdsServiceServer::DdsServiceServer(DdsParticipant& participant, const replay::ServiceNames& names,
                                   OnRequest on_request)
    : on_request_(std::move(on_request)),
      replies_(participant, names.reply_topic, names.reply_type, kServices),
      requests_(std::make_unique<DdsReader>(participant, names.request_topic, names.request_type,
                                            kServices, [this](DdsSample&& request) {
                                              SampleIdentity identity = request.identity;
                                              if (request.related.writer.isKnown())
                                                identity.writer = request.related.writer;
                                              on_request_(identity, std::move(request.cdr));
                                            })) {}

void DdsServiceServer::reply(const SampleIdentity& request, const replay::Bytes& cdr) {
  const auto end = std::chrono::steady_clock::now() + kClientPatience;
  for (;;) {
    const std::vector<DdsGuid> readers = replies_.matched();
    // A request may name the writer of its client alone.
    const bool is_there = std::any_of(readers.begin(), readers.end(), [&](const DdsGuid& reader) {
      return reader.isOfParticipant(request.writer);
    });
    if (is_there || std::chrono::steady_clock::now() >= end) break;
    std::this_thread::sleep_for(kClientLook);
  }
  replies_.write(cdr, request);
}

}  // namespace afterglow::nodes
