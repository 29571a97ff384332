/// \file
/// Search for behaviors in a MongoDB store: the server narrows, Filter judges. Internal to
/// replay/store.
///
/// A behavior's messages from a MongoDB server, in total order over the collections of its topics.
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "replay/store/mongo/mongo_messages.hpp"

namespace afterglow::replay {

/// A query that finds every message for which the condition holds, and others, too. Empty if the
/// server cannot narrow the condition down.
std::optional<Bson> narrowing(const Condition& condition, const Schema& schema);

/// A search for behaviors, with what it cost. Throws StoreError. Everything it is made of must
/// outlive it.
class MongoQuery {
 public:
  /// `database`: that of the behaviors.
  MongoQuery(const MongoClient& client, const std::string& database, const MongoMessages& messages,
             const BehaviorFilter& filter)
      : client_(client), database_(database), messages_(messages), filter_(filter) {}

  std::vector<Behavior> run();         ///< see Store::behaviors()
  std::vector<std::string> explain();  ///< see Store::explain()

 private:
  Bson candidates() const;
  bool isWanted(const Behavior& behavior);
  bool hasMessage(const Behavior& behavior, const std::string& topic, const Condition* condition);

  const MongoClient& client_;
  const std::string& database_;
  const MongoMessages& messages_;
  const BehaviorFilter& filter_;
  std::size_t behaviors_ = 0, looked_at_ = 0;  ///< looked_at_: messages
  std::set<std::string> asked_;                ///< the server's questions about messages
};

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
