/// \file
/// A behavior's messages from a MongoDB server, in total order over the collections of its topics.
#pragma once

#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "replay/store/mongo/mongo_messages.hpp"

namespace afterglow::replay {

/// Reads every collection in pages of its own and merges them. Between two pages nothing is held on
/// the server: the reader may pause for as long as it likes, and the server may be restarted.
class MongoCursor final : public MessageCursor {
 public:
  MongoCursor(const MongoMessages& messages, const Behavior& behavior, const MessageRange& range);
  std::optional<Message> next() override;

 private:
  struct Lane {
    std::string collection;
    std::vector<std::int64_t> channels;
    std::shared_ptr<const Schema> schema;  ///< schema that narrows the filter; null: several
    std::deque<Message> page;
    Stamp received;              ///< begin of the next page ...
    std::int64_t sequence = -1;  ///< ... behind this one of that stamp
    bool is_done = false;
  };

  void readPage(Lane& lane);
  Bson pageQuery(const Lane& lane) const;

  const MongoMessages& messages_;
  std::string recording_key_;
  Stamp end_;
  std::shared_ptr<const Filter> where_;
  std::vector<Lane> lanes_;
};

}  // namespace afterglow::replay
