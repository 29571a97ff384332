#include "replay/store/mongo/mongo_imports.hpp"

namespace afterglow::replay {
namespace {

/// Clocks of a fleet may differ by much less.
constexpr std::chrono::hours kLease{1};
constexpr std::chrono::minutes kRenewal{1};

}  // namespace

void MongoImports::lease(std::int64_t recording) const {
  Bson until;
  until.addDate("import_until", wallClock_ms() + std::chrono::milliseconds(kLease).count());
  client_.update(database_, "recordings", withId(recording), Bson().add("$set", until));
}

void MongoImports::begin(std::int64_t recording) {
  lease(recording);
  renewed_[recording] = std::chrono::steady_clock::now();
}

void MongoImports::renew(std::int64_t recording) {
  const auto import = renewed_.find(recording);
  const auto now = std::chrono::steady_clock::now();
  if (import == renewed_.end() || now - import->second < kRenewal) return;
  lease(recording);
  import->second = now;
}

void MongoImports::finish(std::int64_t recording) {
  const auto found = client_.findOne(database_, "recordings", withId(recording));
  if (!found || !hasAt(found->raw(), "import_until")) {
    client_.fail("finish import " + std::to_string(recording), "it is not under way any more");
  }
  client_.update(database_, "recordings", withId(recording),
                 Bson().add("$unset", Bson().add("import_until", 1)));
  undo_.onFailure([this, recording] { lease(recording); });
  forget(recording);
}

std::vector<std::int64_t> MongoImports::dead() const {
  Bson before;
  before.addDate("$lt", wallClock_ms());
  std::vector<std::int64_t> dead;
  client_.find(database_, "recordings", Bson().add("import_until", before), {},
               [&](const bson_t& document) {
                 dead.push_back(integerAt(document, "_id").value_or(0));
                 return true;
               });
  return dead;
}

}  // namespace afterglow::replay
