/// \file
/// Search for behaviors in a MongoDB store: the server narrows, Filter judges. Internal to
/// replay/store.
#pragma once

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

}  // namespace afterglow::replay
